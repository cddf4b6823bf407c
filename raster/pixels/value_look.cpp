#include "raster/pixels/value_look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "proto/mesh.h"
#include "raster/open/dataset.h"
#include "raster/pixels/decimation.h"
#include "raster/pixels/pixels.h"
#include "raster/pixels/short_number.h"

namespace cordillera::raster {
namespace {

constexpr double kGoodPart = 0.01;  // of the values with a height
/// What programs write for no data. -32768 and 65535 are here for rasters in decimetres: in metres they are beyond the limit.
constexpr std::array kUsual = {-9999.0, 9999.0, -99999.0, 99999.0, -999.0, -32767.0, -32768.0, 32767.0, 65535.0};
constexpr double kNear = 0.02;                // of the value, on either side
constexpr double kWellAbove_m = 10;           // a coast has heights between the sea's and the land's
constexpr std::int64_t kTimesNeighbours = 4;  // a value of the terrain has others near it, about as many of each

std::string percent_text(double share) {
  char text[40];
  std::snprintf(text, sizeof text, share < 1e-4 ? "less than 0.01 %%" : share < 0.1 ? "%.2g %%" : "%.0f %%", 100 * share);
  return text;
}

/// The least and the greatest of heights beyond the limit, and how often.
struct Rim {
  double height_m = 0;
  std::int64_t pixels = 0;
  template <class Beyond>
  void add(double height, const Beyond& beyond) {
    if (pixels == 0 || beyond(height, height_m)) *this = {height, 0};
    if (height == height_m) ++pixels;
  }
};

/// How often a usual value came, and others near it.
struct Count {
  std::int64_t exact = 0, near = 0;
};

}  // namespace

ValueLook look_at_values(const Dataset& dataset, const HeightRule& rule, const Decimation& pixels) {
  const Validity valid(dataset);
  const auto count = static_cast<std::size_t>(pixels.columns) * static_cast<std::size_t>(pixels.rows);
  const GDALDataType type = dataset.band->GetRasterDataType();
  std::vector<double> raw(count);
  GDALCopyWords64(pixels.values.data(), type, GDALGetDataTypeSizeBytes(type), raw.data(), GDT_Float64, sizeof(double),
                  static_cast<GPtrDiff_t>(count));
  ValueLook look;
  look.pixels = static_cast<std::int64_t>(count);
  look.whole = pixels.columns == pixels.covered_columns && pixels.rows == dataset.rows;
  std::array<Count, kUsual.size()> usual{};
  Rim lowest, highest;
  for (std::size_t i = 0; i < count; ++i) {
    if (!pixels.mask.empty() && pixels.mask[i] == 0) continue;
    const double value = dataset.signed_byte && raw[i] > 127 ? raw[i] - 256 : raw[i];
    if (!valid(value)) continue;
    const double height_m = rule.scale * value + rule.offset_m;
    if (!(std::abs(height_m) <= proto::kMaxHeight_m)) {
      ++look.far;
      lowest.add(height_m, std::less<>());
      highest.add(height_m, std::greater<>());
      continue;
    }
    if (look.with_height++ == 0) look.lowest_m = look.highest_m = height_m;
    if (value == 0) {
      ++look.zeros;
      look.zero_m = height_m;
    } else if (look.with_height - look.zeros == 1 || height_m < look.lowest_other_m) {
      look.lowest_other_m = height_m;
    }
    look.lowest_m = std::min(look.lowest_m, height_m);
    look.highest_m = std::max(look.highest_m, height_m);
    for (std::size_t k = 0; k < kUsual.size(); ++k) {
      if (value == kUsual[k])
        ++usual[k].exact;
      else if (std::abs(value - kUsual[k]) < kNear * std::abs(kUsual[k]))
        ++usual[k].near;
    }
  }
  look.far_at_rims = lowest.pixels + (lowest.height_m == highest.height_m ? 0 : highest.pixels);
  look.lowest_far_m = lowest.height_m;
  look.highest_far_m = highest.height_m;
  for (std::size_t k = 0; k < kUsual.size(); ++k) {
    if (usual[k].exact > kTimesNeighbours * usual[k].near) look.doubtful.push_back({kUsual[k], usual[k].exact});
  }
  return look;
}

void add(const ValueLook& other, ValueLook& look) {
  const auto widen = [](double& lowest, double& highest, bool had, double low, double high) {
    lowest = had ? std::min(lowest, low) : low;
    highest = had ? std::max(highest, high) : high;
  };
  if (other.with_height > 0) widen(look.lowest_m, look.highest_m, look.with_height > 0, other.lowest_m, other.highest_m);
  if (other.far > 0) widen(look.lowest_far_m, look.highest_far_m, look.far > 0, other.lowest_far_m, other.highest_far_m);
  if (other.with_height > other.zeros) {
    const bool had = look.with_height > look.zeros;
    look.lowest_other_m = had ? std::min(look.lowest_other_m, other.lowest_other_m) : other.lowest_other_m;
  }
  if (other.zeros > 0) look.zero_m = other.zero_m;
  look.zeros += other.zeros;
  look.whole = other.whole && (look.whole || look.pixels == 0);
  look.rasters = (look.pixels == 0 ? 0 : look.rasters) + other.rasters;
  look.pixels += other.pixels;
  look.with_height += other.with_height;
  look.far += other.far;
  look.far_at_rims += other.far_at_rims;
  for (const ValueLook::Doubtful& value : other.doubtful) {
    const auto known =
        std::find_if(look.doubtful.begin(), look.doubtful.end(), [&](const auto& one) { return one.raw == value.raw; });
    if (known == look.doubtful.end())
      look.doubtful.push_back(value);
    else
      known->pixels += value.pixels;
  }
}

std::vector<std::string> notes_on(const ValueLook& look) {
  std::vector<std::string> notes;
  const auto all = static_cast<double>(look.with_height + look.far);
  // One value alone beyond the limit is no data by another name, and is taken so.
  if (look.with_height > 0 && static_cast<double>(look.far - look.far_at_rims) >= kGoodPart * all) {
    notes.push_back(
        percent_text(static_cast<double>(look.far) / all) + " of the values are heights beyond 16384 m, from " +
        short_number(look.lowest_far_m) + " to " + short_number(look.highest_far_m) +
        " m, and count as no data; z_scale= takes values in another unit to metres, nodata= names one that means none");
  }
  for (const ValueLook::Doubtful& value : look.doubtful) {
    const std::string name = short_number(value.raw);
    notes.push_back(percent_text(static_cast<double>(value.pixels) / all) + " of the values are " + name +
                    ", which may mean no data and is not declared: they are heights here; nodata=" + name + " leaves them out");
  }
  const bool others = look.with_height > look.zeros;
  if (others && static_cast<double>(look.zeros) >= kGoodPart * all && look.lowest_other_m >= look.zero_m + kWellAbove_m) {
    notes.push_back(percent_text(static_cast<double>(look.zeros) / all) + " of the values are 0, and no other height is below " +
                    short_number(look.lowest_other_m) +
                    " m: 0 may mean no data and is not declared; nodata=0 leaves these pixels out");
  }
  return notes;
}

std::string text_of(const ValueLook& look, const std::string& datum) {
  if (look.with_height == 0) return "";
  char range[80];
  std::snprintf(range, sizeof range, "%.2f to %.2f m above ", look.lowest_m, look.highest_m);
  const std::int64_t voids = look.pixels - look.with_height;
  return range + datum + ", " +
         (voids == 0 ? "no" : percent_text(static_cast<double>(voids) / static_cast<double>(look.pixels))) + " voids, at " +
         (look.whole ? "all pixels"
                     : std::to_string(look.pixels) + " pixels spread over " + (look.rasters > 1 ? "the rasters" : "the raster"));
}

}  // namespace cordillera::raster
