#include "raster/pixels/shared_pixels.h"

#include <algorithm>
#include <utility>

namespace cordillera::raster {

bool SharedPixels::read(std::size_t raster, const PixelWindow& window, std::vector<double>& heights) const {
  const std::int64_t end = window.y + window.rows;
  std::vector<std::shared_ptr<const Kept>> over;
  {
    const std::lock_guard lock(mutex_);
    const auto is_over = [&](const std::shared_ptr<const Kept>& kept) {
      const PixelWindow& w = kept->window;
      return w.x <= window.x && w.x + w.columns >= window.x + window.columns && w.y < end && w.y + w.rows > window.y &&
             kept->raster == raster;
    };
    std::copy_if(kept_.begin(), kept_.end(), std::back_inserter(over), is_over);
  }
  heights.resize(window.count());
  for (std::int64_t y = window.y; y < end;) {
    const auto has_row = [y](const auto& kept) { return kept->window.y <= y && y < kept->window.y + kept->window.rows; };
    const auto found = std::find_if(over.begin(), over.end(), has_row);
    if (found == over.end()) return false;
    const PixelWindow& w = (*found)->window;
    const double* from = (*found)->heights.data() + (y - w.y) * w.columns + (window.x - w.x);
    for (; y < std::min(end, w.y + w.rows); ++y, from += w.columns)
      std::copy_n(from, window.columns, heights.begin() + (y - window.y) * window.columns);
  }
  return true;
}

void SharedPixels::keep(std::size_t raster, const PixelWindow& window, const std::vector<double>& heights) {
  constexpr std::size_t kMany = 8, kSmall = 2 << 20;
  const auto bytes_of = [](const PixelWindow& w) { return w.count() * sizeof(double); };
  const std::size_t bytes = bytes_of(window);
  if (bytes > std::max(most_bytes_ / kMany, std::min(most_bytes_, kSmall))) return;
  auto kept = std::make_shared<const Kept>(Kept{raster, window, heights});
  const std::lock_guard lock(mutex_);
  for (; bytes_ + bytes > most_bytes_; kept_.pop_back()) bytes_ -= bytes_of(kept_.back()->window);
  bytes_ += bytes;
  kept_.push_front(std::move(kept));
}

void SharedPixels::clear() {
  const std::lock_guard lock(mutex_);
  kept_.clear();
  bytes_ = 0;
}

}  // namespace cordillera::raster
