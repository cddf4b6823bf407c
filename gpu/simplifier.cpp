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
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int) {
  return proto::Problem{"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}
#endif

proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device) {
  if (device == "cpu") return make_host_waves();
  if (device.empty() || device == "auto") {
    auto cuda = make_cuda_waves(0);
    if (cuda.ok()) return cuda;
    return make_host_waves();
  }
  int number = 0;
  if (device != "cuda") {
    if (!device.starts_with("cuda:")) return unknown_device(device);
    const char* end = device.data() + device.size();
    const auto [stop, error] = std::from_chars(device.data() + 5, end, number);
    if (error != std::errc{} || stop != end || number < 0) return unknown_device(device);
  }
  return make_cuda_waves(number);
}

}  // namespace cordillera::gpu
