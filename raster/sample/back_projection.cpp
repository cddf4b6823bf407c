#include "raster/sample/back_projection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "proto/cell_triangle.h"
#include "proto/ellipsoid.h"
#include "proto/mesh.h"
#include "proto/wide.h"
#include "raster/pixels/decimation.h"
#include "raster/sample/bounds_around.h"

namespace cordillera::raster {
namespace {

constexpr int kRounds = kProjectionRounds;  // a round carries what the window's end lacks one vertex farther
// A wall between two pixels with one sample in between cannot meet both, unless the samples beyond are above the roof and below
// the ground. But most walls can: samples that are bounded at first find that out. Without bounds made towers of 80 m wore crowns
// of 28 m, with bounds of 7 m.
constexpr int kBoundedRounds = kRounds * 2 / 3;
// Beside a wall alone: where samples as near as that differ by more than the height of so many cells. Peaks stay free.
constexpr double kWallCells = 5;
// Beside a pole columns are a millimetre apart, and a sample that moves alone is a needle. Points of tiles are rounded to a
// 32,768th of the target there, which on a needle of this slope is a tenth of it: no sample moves farther than so many times
// a column's width. Where columns are as wide as pixels that is far more than ground asks for.
constexpr double kMostSlope = 4096;
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
constexpr std::uint32_t kNowhere = UINT32_MAX;
constexpr double kHalfMeridian_m = 3.14159265358979323846 * proto::kSemiMajor_m;

/// A pixel and the corners of its triangle.
struct Hold {
  std::array<std::uint32_t, 3> vertex{};
  std::array<double, 3> weight{};
  double height_m = 0;
  double within_m = 0;
};

/// What did not move comes out as it went in, voids too.
CORDILLERA_WIDE void put_back(const double* height_m, std::size_t count, std::int32_t* height) {
  for (std::size_t k = 0; k < count; ++k)
    height[k] = static_cast<std::int32_t>(std::nearbyint(height_m[k] / proto::kHeightStep_m));
}

/// A window of samples on its way. Most pixels are near enough from the start: those that are not, and then those beside vertices
/// that moved, are all that a round looks at. So of each no more is kept than where it is.
class Sheet {
 public:
  Sheet(const proto::Lattice& lattice, proto::Samples& samples, const std::vector<PixelPoint>& pixels, double within_m)
      : lattice_(lattice),
        samples_(samples),
        pixels_(pixels),
        within_m_(within_m),
        wall_m_(kWallCells * kHalfMeridian_m / static_cast<double>(lattice.rows())),  // of any window the same
        south_pole_end_(samples.south <= 0 ? static_cast<std::size_t>(samples.columns) : 0),
        north_pole_begin_(samples.height.size() -
                          (samples.south + samples.rows > lattice.rows() ? static_cast<std::size_t>(samples.columns) : 0)),
        held_by_(samples.height.size(), 0) {
    const auto height_m = [&](std::uint32_t k) { return samples.height[k] * proto::kHeightStep_m; };
    cells_.reserve(pixels.size());
    for (const PixelPoint& pixel : pixels) {
      const std::uint32_t cell = cell_of(pixel);
      const Hold h = hold_of(pixel, cell);
      // No triangle is there.
      const bool none = is_void(h.vertex[0]) || is_void(h.vertex[1]) || is_void(h.vertex[2]);
      cells_.push_back(none ? kNowhere : cell);
      if (none) continue;
      for (std::size_t k = 0; k < 3; ++k) held_by_[h.vertex[k]] += h.weight[k] > 0 ? 1 : 0;
      if (is_far_off(h, height_m)) far_off_.push_back(static_cast<std::uint32_t>(cells_.size() - 1));
    }
  }

  void project() {
    if (far_off_.empty()) return;
    const std::size_t count = held_by_.size();
    height_m_.resize(count), sums_.resize(count, 0), moved_.resize(count, 0);
    bounds_.emplace(samples_);
    for (std::int64_t j = samples_.south; j < samples_.south + samples_.rows; ++j)
      most_move_m_.push_back(kMostSlope * proto::row_frame(lattice_, j).cos_lat * proto::cell_height_m(lattice_, j));
    for (std::size_t k = 0; k < count; ++k) height_m_[k] = samples_.height[k] * proto::kHeightStep_m;
    for (const std::uint32_t p : far_off_) spread(hold_of(pixels_[p], cells_[p]), is_bounded(1));
    for (int round = 1; !touched_.empty(); ++round) {
      move_touched(is_bounded(round));
      if (round < kRounds) spread_beside_moved(is_bounded(round + 1));
    }
    put_back(height_m_.data(), height_m_.size(), samples_.height.data());
  }

 private:
  static bool is_bounded(int round) { return round <= kBoundedRounds; }
  bool is_void(std::size_t k) const { return samples_.height[k] == proto::kNoHeight; }
  bool moves(std::size_t k) const {
    return (samples_.flat_water[k] & proto::kFlatWater) == 0 && k >= south_pole_end_ && k < north_pole_begin_;
  }

  template <class HeightAt>
  static double missing_m(const Hold& h, const HeightAt& height_m) {
    const double surface_m =
        h.weight[0] * height_m(h.vertex[0]) + h.weight[1] * height_m(h.vertex[1]) + h.weight[2] * height_m(h.vertex[2]);
    return h.height_m - surface_m;
  }
  template <class HeightAt>
  static bool is_far_off(const Hold& h, const HeightAt& height_m) {
    return std::abs(missing_m(h, height_m)) > h.within_m * (1 + kGraceShare);
  }

  /// The step over the sum of squared weights, each times the pixels of its vertex.
  double share_of(const Hold& h) const {
    double squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (moves(h.vertex[k])) squares += static_cast<double>(held_by_[h.vertex[k]]) * (h.weight[k] * h.weight[k]);
    }
    return squares > 0 ? kStep / squares : 0;
  }

  /// bounded: so is the round in which the vertices will move.
  void spread(const Hold& h, bool bounded) {
    const double far_m = missing_m(h, [this](std::uint32_t k) { return height_m_[k]; });
    const double grains = (far_m - std::copysign(h.within_m, far_m)) * share_of(h) * kGrain;
    for (std::size_t k = 0; k < 3; ++k) {
      sums_[h.vertex[k]] += std::llrint(h.weight[k] * grains);
      if (bounded) bounds_->at(h.vertex[k]).add(h.height_m);
      touched_.push_back(h.vertex[k]);
    }
  }

  bool is_beside_a_wall(const BoundsAround::Bounds& bounds) const { return bounds.greatest_m - bounds.least_m > wall_m_; }

  void move_touched(bool bounded) {
    for (const std::uint32_t k : last_moved_) moved_[k] = 0;
    last_moved_.clear();
    for (const std::uint32_t k : touched_) {
      const std::int64_t sum = std::exchange(sums_[k], 0);  // what was touched twice is done with the first time
      if (sum == 0 || !moves(k)) continue;
      height_m_[k] = std::clamp(height_m_[k] + static_cast<double>(sum) / kGrain, -proto::kMaxHeight_m, proto::kMaxHeight_m);
      if (bounded && is_beside_a_wall(bounds_->at(k)))
        height_m_[k] = std::clamp(height_m_[k], bounds_->at(k).least_m, bounds_->at(k).greatest_m);
      const double before_m = samples_.height[k] * proto::kHeightStep_m,
                   most_m = most_move_m_[k / static_cast<std::uint32_t>(samples_.columns)];
      height_m_[k] = std::clamp(height_m_[k], before_m - most_m, before_m + most_m);
      moved_[k] = 1;
      last_moved_.push_back(k);
    }
    touched_.clear();
  }

  /// Pixels around which nothing moved in the last round are as near as they were.
  void spread_beside_moved(bool bounded) {
    if (last_moved_.empty()) return;
    const auto up = static_cast<std::size_t>(samples_.columns);
    const auto height_m = [this](std::uint32_t k) { return height_m_[k]; };
    for (std::size_t p = 0; p < cells_.size(); ++p) {
      if (cells_[p] == kNowhere) continue;
      const std::uint8_t* const corner = moved_.data() + cells_[p];
      if ((corner[0] | corner[1] | corner[up] | corner[up + 1]) == 0) continue;
      const Hold h = hold_of(pixels_[p], cells_[p]);
      if ((moved_[h.vertex[0]] | moved_[h.vertex[1]] | moved_[h.vertex[2]]) != 0 && is_far_off(h, height_m)) spread(h, bounded);
    }
  }

  std::uint32_t south_of(const PixelPoint& pixel) const {
    return std::min(static_cast<std::uint32_t>(pixel.y), static_cast<std::uint32_t>(samples_.rows - 2));
  }
  std::uint32_t cell_of(const PixelPoint& pixel) const {
    return south_of(pixel) * static_cast<std::uint32_t>(samples_.columns) + static_cast<std::uint32_t>(pixel.x);
  }
  Hold hold_of(const PixelPoint& pixel, std::uint32_t cell) const {
    const auto columns = static_cast<std::uint32_t>(samples_.columns), west = static_cast<std::uint32_t>(pixel.x),
               south = south_of(pixel);
    const auto corners = proto::triangle_around(pixel.x - west, pixel.y - south, is_void(cell), is_void(cell + columns + 1));
    Hold h;
    for (std::size_t k = 0; k < 3; ++k) {
      h.vertex[k] = cell + corners[k].north * columns + corners[k].east;
      h.weight[k] = corners[k].weight;
    }
    h.height_m = pixel.height_m;
    h.within_m = is_beside_a_side(pixel) ? kSideShare * within_m_ : within_m_;
    return h;
  }

  /// In the same cell of the lattice as a tile's side, or in the one beyond it.
  bool is_beside_a_side(const PixelPoint& pixel) const {
    const auto beside = [](std::int64_t cell) { return cell % proto::kTileCells == 0 || (cell + 1) % proto::kTileCells == 0; };
    return beside(samples_.west + static_cast<std::int64_t>(pixel.x) + lattice_.columns()) ||
           beside(samples_.south + static_cast<std::int64_t>(pixel.y));
  }

  const proto::Lattice& lattice_;
  proto::Samples& samples_;
  const std::vector<PixelPoint>& pixels_;
  const double within_m_;
  const double wall_m_;
  const std::size_t south_pole_end_, north_pole_begin_;  ///< samples; a pole's row is one point
  std::vector<std::uint32_t> held_by_;                   ///< indexed by sample: how many pixels move it
  std::vector<double> height_m_;                         ///< likewise; of voids no height. Once there is something to move, as:
  std::vector<std::int64_t> sums_;                       ///< likewise: what a round moves it by, in grains
  std::vector<std::uint8_t> moved_;                      ///< likewise: 1 if the last round did
  std::vector<std::uint32_t> last_moved_;                ///< those samples
  std::vector<std::uint32_t> touched_;                   ///< samples with sums, some more than once
  std::vector<double> most_move_m_;                      ///< indexed by row: how far a sample may
  std::optional<BoundsAround> bounds_;                   ///< of the samples as they were, and of the pixels that move them
  std::vector<std::uint32_t> cells_;                     ///< indexed by pixel: the south-western vertex of its cell, or kNowhere
  std::vector<std::uint32_t> far_off_;                   ///< pixels, from the start
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
  proto::Result<void> nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) override {
    return source_->nearest_in_cells(lattice, cells, out);
  }
  proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice& lattice, const Window& cells) override {
    return source_->pixels(lattice, cells);
  }
  proto::Result<std::shared_ptr<const Decimation>> decimate(std::int64_t most_pixels) override {
    return source_->decimate(most_pixels);
  }
  std::string datum_print() const override { return source_->datum_print(); }
  void share_pixels(const std::shared_ptr<SharedPixels>& lately, std::size_t raster) override {
    source_->share_pixels(lately, raster);
  }

  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override {
    if (columns == 0 || rows == 0 || lattice.finest_level != level_ || empty(lattice, west, south, columns, rows))
      return source_->sample(lattice, west, south, columns, rows);
    const Window wide{west - kProjectionReach, std::max<std::int64_t>(0, south - kProjectionReach),
                      west + columns - 1 + kProjectionReach, std::min(lattice.rows(), south + rows - 1 + kProjectionReach)};
    // Pixels first: their window holds that of the samples, so that it is read once.
    const auto pixels = source_->pixels(lattice, wide);
    if (!pixels.ok()) return pixels.problem();
    auto samples = source_->sample(lattice, wide.west, wide.south, static_cast<std::int32_t>(wide.east - wide.west + 1),
                                   static_cast<std::int32_t>(wide.north - wide.south + 1));
    if (!samples.ok()) return samples;
    Sheet(lattice, *samples, *pixels, within_m_).project();
    cut(*samples, {west, south, west + columns - 1, south + rows - 1});
    return samples;
  }

 private:
  /// The window's part of the samples, in their own memory: rows only move towards the first.
  static void cut(proto::Samples& samples, const Window& w) {
    const auto columns = static_cast<std::int32_t>(w.east - w.west + 1);
    std::ptrdiff_t to = 0;
    for (std::int64_t j = w.south; j <= w.north; ++j, to += columns) {
      const auto from = static_cast<std::ptrdiff_t>((j - samples.south) * samples.columns + (w.west - samples.west));
      std::copy_n(samples.height.begin() + from, columns, samples.height.begin() + to);
      std::copy_n(samples.flat_water.begin() + from, columns, samples.flat_water.begin() + to);
    }
    samples.height.resize(static_cast<std::size_t>(to));
    samples.flat_water.resize(static_cast<std::size_t>(to));
    samples.west = w.west, samples.south = w.south;
    samples.columns = columns, samples.rows = static_cast<std::int32_t>(w.north - w.south + 1);
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
