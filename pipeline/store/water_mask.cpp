#include "pipeline/store/water_mask.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline {
namespace {

constexpr std::size_t kPixels = std::size_t{kWaterSide} * kWaterSide;

}  // namespace

bool has_water(const proto::BuildOptions& options) { return options.has_water() || !options.water_mask().empty(); }

std::string water_mask_name(const proto::BuildOptions& options) {
  return std::filesystem::path(options.water_mask()).filename().string();
}

std::string pack_water(const WaterPixels& pixels) {
  if (pixels.empty()) return {};
  const bool one_value = std::all_of(pixels.begin(), pixels.end(), [&](std::uint8_t p) { return p == pixels[0]; });
  if (one_value) return pixels[0] == 0 ? std::string() : std::string(1, static_cast<char>(pixels[0]));
  uLongf bytes = compressBound(pixels.size());
  std::string out(bytes, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &bytes, pixels.data(), pixels.size(), Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::logic_error("zlib could not compress a water mask");
  }
  out.resize(bytes);
  return out;
}

WaterPixels unpack_water(std::string_view packed) {
  if (packed.empty()) return {};
  if (packed.size() == 1) return WaterPixels(kPixels, static_cast<std::uint8_t>(packed[0]));
  WaterPixels out(kPixels);
  uLongf bytes = out.size();
  const auto* from = reinterpret_cast<const Bytef*>(packed.data());
  if (uncompress(out.data(), &bytes, from, packed.size()) != Z_OK || bytes != kPixels)
    throw StoreError("a water mask is damaged");
  return out;
}

WaterPixels coarser_water(const std::array<const WaterPixels*, 4>& children) {
  WaterPixels out;
  constexpr int kHalf = kWaterSide / 2;
  for (std::size_t c = 0; c < 4; ++c) {
    if (children[c] == nullptr || children[c]->empty()) continue;
    if (out.empty()) out.assign(kPixels, 0);
    const std::size_t east = (c & 1) * kHalf, south = (c >> 1) != 0 ? 0 : kHalf;
    for (std::size_t r = 0; r < kHalf; ++r) {
      for (std::size_t q = 0; q < kHalf; ++q) {
        const std::uint8_t* p = children[c]->data() + 2 * r * kWaterSide + 2 * q;
        out[(south + r) * kWaterSide + east + q] =
            static_cast<std::uint8_t>((p[0] + p[1] + p[kWaterSide] + p[kWaterSide + 1] + 2) / 4);
      }
    }
  }
  return out;
}

}  // namespace cordillera::pipeline
