#include "tests/bench/batch_meter/surface_error_batch.inl"
#include "gpu/device/device_choice.h"
#include "gpu/device/host_steps.h"
#include "tests/bench/batch_meter/surface_error_cuda.h"

namespace cordillera::gpu {
namespace {

class HostMeterDevice : public HostSteps {
 public:
  template <class T>
  using Staging = Array<T>;
  void use() {}
  std::string name() const { return "cpu"; }
};

}  // namespace

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int, ParallelFor) { return built_without_cuda(); }
#endif

proto::Result<std::unique_ptr<BatchMeter>> make_batch_meter(const std::string& device, ParallelFor parallel) {
  const auto host = [&]() -> std::unique_ptr<BatchMeter> {
    return std::make_unique<BatchMeterOn<HostMeterDevice>>(std::make_unique<HostMeterDevice>(), parallel);
  };
  return on_device(device, host, [&](int number) { return make_cuda_batch_meter(number, parallel); });
}

}  // namespace cordillera::gpu
