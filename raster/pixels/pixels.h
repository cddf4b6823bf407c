#pragma once
// Windows of the source as heights in metres, NaN where there is none.
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "proto/result.h"
#include "raster/open/dataset.h"
#include "raster/open/text_rows.h"
#include "raster/pixels/pixel_window.h"
#include "raster/pixels/shared_pixels.h"
#include "raster/pixels/validity.h"

namespace cordillera::raster {

/// What becomes of pixels without data.
enum class VoidRule : std::uint8_t { hole, value };

/// From raw value to metres, and what to do with voids.
struct HeightRule {
  double scale = 1, offset_m = 0;  ///< metres = scale * raw + offset_m
  VoidRule voids = VoidRule::hole;
  double void_height_m = 0;  ///< for VoidRule::value
};

class Pixels {
 public:
  /// period: columns around the earth, 0 when the raster does not close.
  Pixels(const Dataset& dataset, const HeightRule& rule, int period);

  /// What was read lately is then shared with others that read the raster of this number, instead of kept for this one alone.
  void share(std::shared_ptr<SharedPixels> lately, std::size_t raster) { lately_ = std::move(lately), raster_ = raster; }

  /// Fills heights with window.columns * window.rows metres, row-major from the window's first line. What was read lately is not
  /// read again.
  proto::Result<void> read(const PixelWindow& window, std::vector<double>& heights);

  /// What becomes of pixels without data from now on, in place of what the rule says.
  void set_voids(VoidRule voids) { rule_.voids = voids; }

  /// No pixel of the window can be anything but void, by the file's block table, or by what a VRT's sources cover, alone.
  bool certainly_void(const PixelWindow& window) const;

 private:
  proto::Result<void> read_anew(const PixelWindow& window, std::vector<double>& heights);
  proto::Result<void> read_inside(const PixelWindow& part, const PixelWindow& window, std::int64_t shift,
                                  std::vector<double>& heights);
  proto::Result<void> read_stored(const PixelWindow& part, double* out, std::size_t stride);
  void put_height(const PixelWindow& window, std::vector<double>& heights) const;
  bool block_missing(std::int64_t block_x, std::int64_t block_y) const;
  void to_metres(double* line, const std::uint8_t* mask, std::size_t count) const;

  const Dataset& dataset_;
  HeightRule rule_;
  int period_;
  Validity validity_;
  TextRows text_;
  std::vector<std::uint8_t> mask_;  ///< scratch
  std::shared_ptr<SharedPixels> lately_;
  std::size_t raster_ = 0;  ///< its number there
};

}  // namespace cordillera::raster
