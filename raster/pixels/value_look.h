#pragma once
// What the values of a raster are like, from some of its pixels: what a person would want to be asked before they become terrain.
#include <cstdint>
#include <string>
#include <vector>

namespace cordillera::raster {

struct Dataset;
struct Decimation;
struct HeightRule;

struct ValueLook {
  int rasters = 1;                           ///< that were looked at
  std::int64_t pixels = 0, with_height = 0;  ///< that were looked at; of them, those with a height within the limit
  bool whole = false;                        ///< all pixels of the raster were
  double lowest_m = 0, highest_m = 0;        ///< of those with a height, above the vertical datum

  std::int64_t far = 0,
               far_at_rims =
                   0;  ///< with a height beyond the limit, which counts as none; of them, the lowest and the highest height
  double lowest_far_m = 0, highest_far_m = 0;

  /// A value by which files often mean no data, that was not declared and is a height within the limit here.
  struct Doubtful {
    double raw = 0;
    std::int64_t pixels = 0;
  };
  std::vector<Doubtful> doubtful;

  /// Pixels whose value is 0, with a height within the limit. Of them the height; of all others the lowest.
  std::int64_t zeros = 0;
  double zero_m = 0, lowest_other_m = 0;
};

/// Of the dataset's own pixels, thinned out.
ValueLook look_at_values(const Dataset& dataset, const HeightRule& rule, const Decimation& pixels);

/// Puts what was seen of another raster to it.
void add(const ValueLook& other, ValueLook& look);

/// Sentences for people: that a good part of the heights is beyond the limit, and that a value may mean no data. Mostly none.
std::vector<std::string> notes_on(const ValueLook& look);

/// "12.50 to 980.00 m above EGM96, 3.5 % voids, at all pixels"; empty where there are no heights.
std::string text_of(const ValueLook& look, const std::string& datum);

/// So many pixels are looked at, about.
inline constexpr std::int64_t kPixelsLookedAt = std::int64_t{1} << 20;

}  // namespace cordillera::raster
