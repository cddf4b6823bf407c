#pragma once
// Where a tile is water: 256 x 256 pixels, a cell of its level each, rows from the north, columns from the west. 0 is land, 255
// water, what lies between is the share of water in the pixel.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

inline constexpr int kWaterSide = 256;
inline constexpr std::uint8_t kWater = 255;

/// Whether the options of a dataset say where water is.
bool has_water(const proto::BuildOptions& options);
/// The name of water-mask='s file, as manifests have it: they tell nobody of its folder. Empty: none.
std::string water_mask_name(const proto::BuildOptions& options);

/// By row, then column. Empty: all land.
using WaterPixels = std::vector<std::uint8_t>;

/// As the store keeps it: nothing for land, one byte for a tile of one value, else compressed.
std::string pack_water(const WaterPixels& pixels);
/// The way back, for one byte too: always kWaterSide^2 pixels, or none for land. Throws StoreError where the bytes are damaged.
WaterPixels unpack_water(std::string_view packed);

/// A parent's mask: means of two by two pixels, rounded. Index bit 0 east, bit 1 north; null or empty: land.
WaterPixels coarser_water(const std::array<const WaterPixels*, 4>& children);

}  // namespace cordillera::pipeline
