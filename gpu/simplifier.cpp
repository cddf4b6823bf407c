#include <charconv>

#include "gpu/simplify.h"
#include "gpu/waves.h"

namespace cordillera::gpu {
namespace {

proto::Problem unknown_device(const std::string& device) {
  return {"unknown-device", "device \"" + device + "\" is not known", "auto, cpu, cuda, cuda:N", "device"};
}

}  // namespace

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int, ParallelFor) {
  return proto::Problem{"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}
#endif

void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < count; ++i) work(i);
}

proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel) {
  if (device == "cpu") return make_host_waves(std::move(parallel));
  if (device.empty() || device == "auto") {
    auto cuda = make_cuda_waves(0, parallel);
    if (cuda.ok()) return cuda;
    return make_host_waves(std::move(parallel));
  }
  int number = 0;
  if (device != "cuda") {
    if (!device.starts_with("cuda:")) return unknown_device(device);
    const char* end = device.data() + device.size();
    const auto [stop, error] = std::from_chars(device.data() + 5, end, number);
    if (error != std::errc{} || stop != end || number < 0) return unknown_device(device);
  }
  return make_cuda_waves(number, std::move(parallel));
}

}  // namespace cordillera::gpu
