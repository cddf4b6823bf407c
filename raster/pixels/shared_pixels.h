#pragma once
// Windows of pixels that were read lately. A build asks for a place three times: for samples, for the pixels that a tile is
// measured at, and for water; from several threads, each of which has a handle of its own.
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "raster/pixels/pixel_window.h"

namespace cordillera::raster {

/// Thread-safe. Windows that are kept longest go first.
class SharedPixels {
 public:
  /// most_bytes: of all windows, 8 a pixel.
  explicit SharedPixels(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Fills heights with the window's pixels, by rows, where windows that were kept of this raster cover it: each row is in one of
  /// them. Else false, and heights is anything.
  bool read(std::size_t raster, const PixelWindow& window, std::vector<double>& heights) const;
  /// raster: its number among those of the build; every handle on it gives the same pixels. heights: as read() gives them. A
  /// window that would drive out many others is not kept.
  void keep(std::size_t raster, const PixelWindow& window, const std::vector<double>& heights);
  /// When nobody will ask for pixels for a while.
  void clear();

 private:
  struct Kept {
    std::size_t raster = 0;
    PixelWindow window;
    std::vector<double> heights;
  };

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;  ///< of what follows
  std::size_t bytes_ = 0;
  std::deque<std::shared_ptr<const Kept>> kept_;  ///< the newest first
};

}  // namespace cordillera::raster
