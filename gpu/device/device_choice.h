#pragma once
// From the name of a device to what works on it.
#include <charconv>
#include <memory>
#include <string>

#include "proto/result.h"

namespace cordillera::gpu {

/// "cpu", "cuda", "cuda:N"; "auto" or nothing is the first GPU where one can be used and the CPU elsewhere. host() gives a
/// pointer to what works there, cuda(number) a Result of the same or why that device cannot be used.
template <class Host, class Cuda>
auto on_device(const std::string& device, const Host& host, const Cuda& cuda) -> decltype(cuda(0)) {
  if (device == "cpu") return host();
  if (device.empty() || device == "auto") {
    auto first = cuda(0);
    if (first.ok()) return first;
    return host();
  }
  int number = 0;
  bool known = device == "cuda";
  if (device.starts_with("cuda:")) {
    const char* const end = device.data() + device.size();
    const auto [stop, error] = std::from_chars(device.data() + 5, end, number);
    known = error == std::errc{} && stop == end && number >= 0;
  }
  if (!known)
    return proto::Problem{"unknown-device", "device \"" + device + "\" is not known", "auto, cpu, cuda, cuda:N", "device"};
  return cuda(number);
}

inline proto::Problem built_without_cuda() {
  return {"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}

}  // namespace cordillera::gpu
