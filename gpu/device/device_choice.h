#pragma once
// From the name of a device to what works on it.
#include <string>

#include "proto/numbers.h"
#include "proto/result.h"

namespace cordillera::gpu {

inline bool is_any_device(const std::string& device) { return device.empty() || device == "auto"; }

/// "cpu", "cuda", "cuda:N"; "auto" or nothing is the first GPU where one can be used and the CPU elsewhere. host() gives a
/// pointer to what works there, cuda(number) a Result of the same or why that device cannot be used.
template <class Host, class Cuda>
auto on_device(const std::string& device, const Host& host, const Cuda& cuda) -> decltype(cuda(0)) {
  if (device == "cpu") return host();
  if (is_any_device(device)) {
    auto first = cuda(0);
    if (first.ok()) return first;
    return host();
  }
  const std::string_view name = device;
  const auto number = name == "cuda" ? 0 : name.starts_with("cuda:") ? proto::number<int>(name.substr(5)) : std::nullopt;
  if (!number || *number < 0)
    return proto::Problem{"unknown-device", "device \"" + device + "\" is not known", "auto, cpu, cuda, cuda:N", "device"};
  return cuda(*number);
}

inline proto::Problem built_without_cuda() {
  return {"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}

}  // namespace cordillera::gpu
