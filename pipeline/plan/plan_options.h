#pragma once
// What the options that a plan is made of may be. Those who read options from texts check with the same.
#include <array>
#include <optional>
#include <span>
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// The least and the greatest error of a finest level. Heights are steps of a millimetre, and an exact block takes four of them.
inline constexpr double kLeastError_m = 0.01, kGreatestError_m = 1e6;
inline constexpr std::array<const char*, 3> kQualities = {"fast", "default", "best"};

/// What is wrong with shares of triangles, finest level first, as a sentence goes on; nullopt: nothing is.
std::optional<std::string> wrong_with_keep(std::span<const double> shares);

/// Problems: "option-invalid", "options-conflict", and those of gpu::check_strategy.
proto::Result<void> check_options(const proto::BuildOptions& options);

}  // namespace cordillera::pipeline
