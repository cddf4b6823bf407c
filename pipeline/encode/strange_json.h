#pragma once
// JSON that anybody may have written.
#include <cstdint>
#include <string_view>

#include "pipeline/encode/json.h"

namespace cordillera::pipeline {

/// Deepest that it may nest. Parsing takes no stack, but what copies or prints JSON takes some for each level, and a megabyte of
/// brackets would take more than a thread has.
inline constexpr int kMostNested = 64;
/// Names that may be compared. An object looks through its members for each one that is added: these are 10,000 members of one
/// object, or any number in small ones, and take less than a second.
inline constexpr std::uint64_t kMostCompared = 10000ULL * 9999 / 2;

/// Discarded where it is no JSON, or beyond these bounds. From there on it is only read through.
Json json_of_stranger(std::string_view text);

/// For messages: what it takes, after "JSON" or "JSON object".
inline constexpr const char* kStrangeJson = "of at most 64 levels, and of at most 10,000 members in an object";

}  // namespace cordillera::pipeline
