#pragma once
// A height that is put where a raster has no data: what voids= may say.
#include <optional>
#include <string>

#include "proto/result.h"

namespace cordillera::raster {

/// The deepest land, the Dead Sea's shore, is at -430 m: what is deeper is a value that means no data, taken for a height.
inline constexpr int kLeastVoidHeight_m = -500;

/// nullopt: fill, hole or nothing; what is filled is void to the raster itself, see filled_source.h. Else a height, which may
/// begin with a "+". "option-invalid", with why as a sentence goes on behind the value: "higher than any height may be".
proto::Result<std::optional<double>> void_height_m(const std::string& text);

}  // namespace cordillera::raster
