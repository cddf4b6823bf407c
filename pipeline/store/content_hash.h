#pragma once
// The name of bytes: equal bytes are stored once, and an ETag stays the same over a rebuild that changes nothing.
#include <cstddef>
#include <string>
#include <string_view>

#include "proto/letters.h"

namespace cordillera::pipeline {

inline constexpr std::size_t kHashBytes = 16;

/// First kHashBytes of SHA-256.
std::string content_hash(std::string_view bytes);
/// 16 bytes; for formats that ask for it, never to tell contents apart.
std::string md5(std::string_view bytes);
using proto::hex;

}  // namespace cordillera::pipeline
