#pragma once
// Which of a file's bands are the colours, and a part of them in memory.
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "proto/result.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {

/// A photo as it is read at one scale: an overview of the file, and whole blocks of its pixels made one. Columns and rows beyond
/// the last whole block are a smaller block.
struct PhotoLayer {
  int overview = -1;                ///< -1: the pixels themselves
  int factor = 1;                   ///< pixels of the overview along a side of a block
  int columns = 0, rows = 0;        ///< blocks
  double scale_x = 1, scale_y = 1;  ///< from the file's pixel coordinates to the layer's
};

struct PhotoWindow {
  int x = 0, y = 0, columns = 0, rows = 0;
};

class PhotoBands {
 public:
  /// Problems: "raster-bands", "raster-type".
  static proto::Result<PhotoBands> of(const Dataset& dataset);

  /// The coarsest layer whose pixels are no larger than so many of the file's.
  PhotoLayer layer(const Dataset& dataset, double pixels_x, double pixels_y) const;
  /// Four bytes a pixel of the layer, by row from the north: means, colours weighted by alpha.
  proto::Result<std::vector<std::uint8_t>> read(const Dataset& dataset, const PhotoLayer& layer, const PhotoWindow& window) const;

 private:
  PhotoBands() = default;
  proto::Result<void> choose(const Dataset& dataset);
  GDALRasterBand* band(const Dataset& dataset, int which, int overview) const;
  bool has_overview(const Dataset& dataset, int overview) const;
  proto::Result<void> read_pixels(const Dataset& dataset, int overview, const PhotoWindow& part,
                                  std::vector<std::uint8_t>& rgba) const;

  std::array<int, 3> colours_{};  ///< numbers of bands
  int alpha_ = 0;                 ///< 0: none
  bool masked_ = false;           ///< a mask of the whole file
  std::optional<std::array<double, 3>> nodata_;
};

}  // namespace cordillera::raster
