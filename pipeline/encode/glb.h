#pragma once
// The binary glTF container: one JSON chunk, one binary chunk.
#include <string>
#include <string_view>
#include <utility>

#include "proto/result.h"

namespace cordillera::pipeline {

/// json and binary are padded to 4 bytes as the container asks.
std::string pack_glb(std::string json, std::string binary);
/// The JSON and the binary chunk (padding included), views into bytes.
proto::Result<std::pair<std::string_view, std::string_view>> unpack_glb(std::string_view bytes);

}  // namespace cordillera::pipeline
