#include "raster/sample/back_projection.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "proto/ellipsoid.h"
#include "proto/mesh.h"
#include "raster/pixels/decimation.h"

namespace cordillera::raster {
namespace {

constexpr int kRounds = kProjectionReach - 1;  // a round carries what the window's end lacks one vertex farther
// Each vertex takes its share of a residual divided by the number of pixels that move it (component averaging: Censor, Gordon and
// Gordon 2001). So it converges for any pixels and any step below 2; this one leaves a tenth a round where pixels share no
// vertices.
constexpr double kStep = 1.1;
// Beside a side of a tile, where simplification puts in no vertex later.
constexpr double kSideShare = 1.0 / 2;
// So little too far off, and no vertex is moved any more: rounds get there only in the limit.
constexpr double kGraceShare = 1.0 / 64;
// Sums are of integers, so that their order does not matter.
constexpr double kGrain = 0x1p20;  // a metre

/// A pixel and the corners of its triangle.
struct Hold {
  std::array<std::uint32_t, 3> vertex{};
  std::array<double, 3> weight{};
  double height_m = 0;
  double within_m = 0;
  double share = 0;  ///< of the residual: step over the sum of squared weights, each times the pixels of its vertex
};

/// A window of samples on its way.
class Sheet {
 public:
  Sheet(const proto::Lattice& lattice, proto::Samples& samples, double within_m)
      : lattice_(lattice),
        samples_(samples),
        within_m_(within_m),
        height_m_(samples.height.size()),
        pixels_(height_m_.size(), 0),
        moved_(height_m_.size(), 1) {
    for (std::size_t k = 0; k < height_m_.size(); ++k) height_m_[k] = is_void(k) ? 0 : samples.height[k] * proto::kHeightStep_m;
  }

  void hold(const std::vector<PixelPoint>& pixels) {
    holds_.reserve(pixels.size());
    for (const PixelPoint& pixel : pixels) hold(pixel);
    for (Hold& h : holds_) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        if (moves(h.vertex[k])) sum += static_cast<double>(pixels_[h.vertex[k]]) * (h.weight[k] * h.weight[k]);
      }
      h.share = sum > 0 ? kStep / sum : 0;
    }
  }

  /// Pixels around which nothing moved in the round before are as near as they were.
  void round() {
    std::vector<std::int64_t> sums(height_m_.size(), 0);
    for (const Hold& h : holds_) {
      if ((moved_[h.vertex[0]] | moved_[h.vertex[1]] | moved_[h.vertex[2]]) == 0) continue;
      const double surface_m =
          h.weight[0] * height_m_[h.vertex[0]] + h.weight[1] * height_m_[h.vertex[1]] + h.weight[2] * height_m_[h.vertex[2]];
      const double missing_m = h.height_m - surface_m;
      if (std::abs(missing_m) <= h.within_m * (1 + kGraceShare)) continue;
      const double grains = (missing_m - std::copysign(h.within_m, missing_m)) * h.share * kGrain;
      for (std::size_t k = 0; k < 3; ++k) sums[h.vertex[k]] += std::llrint(h.weight[k] * grains);
    }
    for (std::size_t k = 0; k < sums.size(); ++k) {
      moved_[k] = sums[k] != 0 && moves(k) ? 1 : 0;
      if (moved_[k] != 0)
        height_m_[k] =
            std::clamp(height_m_[k] + static_cast<double>(sums[k]) / kGrain, -proto::kMaxHeight_m, proto::kMaxHeight_m);
    }
  }

  void put_back() {
    for (std::size_t k = 0; k < height_m_.size(); ++k) {
      if (pixels_[k] > 0 && moves(k))
        samples_.height[k] = static_cast<std::int32_t>(std::nearbyint(height_m_[k] / proto::kHeightStep_m));
    }
  }

 private:
  bool is_void(std::size_t k) const { return samples_.height[k] == proto::kNoHeight; }
  bool moves(std::size_t k) const {
    const std::int64_t row = samples_.south + static_cast<std::int64_t>(k) / samples_.columns;
    return (samples_.flat_water[k] & proto::kFlatWater) == 0 && row > 0 && row < lattice_.rows();
  }

  /// Not where a corner is void: no triangle is there.
  void hold(const PixelPoint& pixel) {
    Hold h = triangle_of(pixel);
    if (is_void(h.vertex[0]) || is_void(h.vertex[1]) || is_void(h.vertex[2])) return;
    h.height_m = pixel.height_m;
    h.within_m = is_beside_a_side(pixel) ? kSideShare * within_m_ : within_m_;
    for (std::size_t k = 0; k < 3; ++k) {
      if (h.weight[k] > 0) ++pixels_[h.vertex[k]];
    }
    holds_.push_back(h);
  }

  Hold triangle_of(const PixelPoint& pixel) const {
    const double west = std::floor(pixel.x), south = std::min(std::floor(pixel.y), static_cast<double>(samples_.rows - 2));
    const auto columns = static_cast<std::uint32_t>(samples_.columns);
    const std::uint32_t sw = static_cast<std::uint32_t>(south) * columns + static_cast<std::uint32_t>(west);
    const auto corners = triangle_around(pixel.x - west, pixel.y - south, is_void(sw), is_void(sw + columns + 1));
    Hold h;
    for (std::size_t k = 0; k < 3; ++k) {
      h.vertex[k] = sw + corners[k].north * columns + corners[k].east;
      h.weight[k] = corners[k].weight;
    }
    return h;
  }

  /// In the same cell of the lattice as a tile's side, or in the one beyond it.
  bool is_beside_a_side(const PixelPoint& pixel) const {
    const std::int64_t units = lattice_.tile_units(lattice_.finest_level);
    const auto beside = [units](std::int64_t cell) { return cell % units == 0 || (cell + 1) % units == 0; };
    return beside(samples_.west + static_cast<std::int64_t>(pixel.x) + lattice_.columns()) ||
           beside(samples_.south + static_cast<std::int64_t>(pixel.y));
  }

  const proto::Lattice& lattice_;
  proto::Samples& samples_;
  const double within_m_;
  std::vector<double> height_m_;       ///< indexed by sample
  std::vector<std::uint32_t> pixels_;  ///< likewise: how many move it
  std::vector<std::uint8_t> moved_;    ///< likewise: 1 if the last round did
  std::vector<Hold> holds_;
};

class BackProjection final : public Source {
 public:
  BackProjection(std::unique_ptr<Source> source, int level, double within_m)
      : source_(std::move(source)), level_(level), within_m_(within_m) {}

  const proto::Source& description() const override { return source_->description(); }
  Window window(const proto::Lattice& lattice) const override { return source_->window(lattice); }
  bool empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns,
             std::int64_t rows) const override {
    return source_->empty(lattice, west, south, columns, rows);
  }
  proto::Result<void> nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg, double* out) override {
    return source_->nearest(longitude_deg, latitude_deg, out);
  }
  proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice& lattice, const Window& cells) override {
    return source_->pixels(lattice, cells);
  }
  proto::Result<std::shared_ptr<const Decimation>> decimate(std::int64_t most_pixels) override {
    return source_->decimate(most_pixels);
  }
  std::string datum_print() const override { return source_->datum_print(); }

  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override {
    if (columns == 0 || rows == 0 || lattice.finest_level != level_ || empty(lattice, west, south, columns, rows))
      return source_->sample(lattice, west, south, columns, rows);
    const Window wide{west - kProjectionReach, std::max<std::int64_t>(0, south - kProjectionReach),
                      west + columns - 1 + kProjectionReach, std::min(lattice.rows(), south + rows - 1 + kProjectionReach)};
    auto samples = source_->sample(lattice, wide.west, wide.south, static_cast<std::int32_t>(wide.east - wide.west + 1),
                                   static_cast<std::int32_t>(wide.north - wide.south + 1));
    if (!samples.ok()) return samples;
    const auto pixels = source_->pixels(lattice, wide);
    if (!pixels.ok()) return pixels.problem();
    Sheet sheet(lattice, *samples, within_m_);
    sheet.hold(*pixels);
    for (int round = 0; round < kRounds; ++round) sheet.round();
    sheet.put_back();
    return cut(*samples, {west, south, west + columns - 1, south + rows - 1});
  }

 private:
  static proto::Samples cut(const proto::Samples& from, const Window& w) {
    proto::Samples out{
        w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1), static_cast<std::int32_t>(w.north - w.south + 1),
        {},     {}};
    for (std::int64_t j = w.south; j <= w.north; ++j) {
      const auto at = static_cast<std::ptrdiff_t>((j - from.south) * from.columns + (w.west - from.west));
      out.height.insert(out.height.end(), from.height.begin() + at, from.height.begin() + at + out.columns);
      out.flat_water.insert(out.flat_water.end(), from.flat_water.begin() + at, from.flat_water.begin() + at + out.columns);
    }
    return out;
  }

  std::unique_ptr<Source> source_;
  const int level_;
  const double within_m_;
};

}  // namespace

std::unique_ptr<Source> project_back(std::unique_ptr<Source> source, int level, double within_m) {
  return std::make_unique<BackProjection>(std::move(source), level, within_m);
}

}  // namespace cordillera::raster
