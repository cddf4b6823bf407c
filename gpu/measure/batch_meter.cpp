#include "gpu/measure/batch_meter.h"

#include "gpu/device/device_choice.h"
#include "gpu/device/host_steps.h"
#include "gpu/device/lanes.h"
#include "gpu/measure/batch_meter_on.h"

namespace cordillera::gpu {
namespace {

class HostMeterDevice : public HostSteps {
 public:
  void use() {}
  template <class Step>
  void measure(std::size_t n, const Step& step) {
    each(n, [&](std::size_t i) { step(i, OneLane{}); });
  }
};

}  // namespace

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int) { return built_without_cuda(); }
#endif

proto::Result<std::unique_ptr<BatchMeter>> make_batch_meter(const std::string& device) {
  const auto host = [] {
    return proto::Result<std::unique_ptr<BatchMeter>>(
        proto::Problem{"device-unavailable", "surface_error() measures on the CPU", "cuda, cuda:N", "device"});
  };
  return on_device(device, host, [&](int number) { return make_cuda_batch_meter(number); });
}

std::unique_ptr<BatchMeter> make_host_batch_meter() {
  return std::make_unique<BatchMeterOn<HostMeterDevice>>(std::make_unique<HostMeterDevice>());
}

}  // namespace cordillera::gpu
