#include "pipeline/build/pixel_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "gpu/measure/sample_meter.h"
#include "gpu/measure/surface_error_plane.h"
#include "gpu/measure/upright.h"
#include "gpu/refine/height_step.h"
#include "pipeline/bound/earth.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/pixel_error_sum.h"
#include "pipeline/tile/sample_at.h"
#include "raster/sample/back_projection.h"

namespace cordillera::pipeline {
namespace {

/// Pixels by the cell that they lie in.
class PixelsByCell {
 public:
  PixelsByCell(const std::vector<raster::PixelPoint>& pixels, std::int32_t side)
      : side_(side), start_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) + 1, 0) {
    for (const raster::PixelPoint& pixel : pixels) ++start_[cell_of(pixel) + 1];
    for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    order_.resize(pixels.size());
    for (std::size_t k = 0; k < pixels.size(); ++k) order_[next[cell_of(pixels[k])]++] = static_cast<std::uint32_t>(k);
  }
  /// In a cell that has any there are more than this on average: no samples meet them all.
  bool crowd() const {
    constexpr double kMost = 1.5;
    std::size_t cells = 0;
    for (std::size_t k = 1; k < start_.size(); ++k) cells += start_[k] > start_[k - 1] ? 1 : 0;
    return static_cast<double>(order_.size()) > kMost * static_cast<double>(cells);
  }
  /// Those in cells west .. east of a row.
  std::span<const std::uint32_t> row(std::int32_t row, std::int32_t west, std::int32_t east) const {
    const auto from = static_cast<std::size_t>(row * side_);
    const std::uint32_t first = start_[from + static_cast<std::size_t>(west)],
                        end = start_[from + static_cast<std::size_t>(east) + 1];
    return {order_.data() + first, end - first};
  }

 private:
  std::size_t cell_of(const raster::PixelPoint& pixel) const {
    const auto cell = [this](double at) { return std::min(static_cast<std::int32_t>(at), side_ - 1); };
    return static_cast<std::size_t>(cell(pixel.y) * side_ + cell(pixel.x));
  }
  std::int32_t side_;
  std::vector<std::uint32_t> start_, order_;
};

/// A triangle in plan and in space.
struct Facet {
  std::array<gpu::MeshPoint, 3> corner;
  gpu::Plane plane;
  gpu::HeightRange range;

  /// Exact: places are multiples of 2^-20 of a cell.
  bool holds(double x, double y) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const gpu::MeshPoint &a = corner[k], &b = corner[(k + 1) % 3];
      if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) < 0) return false;
    }
    return true;
  }

  /// First and last cell of a row that it reaches into.
  std::pair<std::int32_t, std::int32_t> stretch(std::int32_t row, std::int32_t side) const {
    double west = side, east = 0;
    const auto take = [&](double x) { west = std::min(west, x), east = std::max(east, x); };
    for (std::size_t k = 0; k < 3; ++k) {
      const gpu::MeshPoint &a = corner[k], &b = corner[(k + 1) % 3];
      if (a.y >= row && a.y <= row + 1) take(a.x);
      for (const std::int32_t y : {row, row + 1}) {
        if ((a.y < y) != (b.y < y)) take(a.x + static_cast<double>(b.x - a.x) * (y - a.y) / (b.y - a.y));
      }
    }
    return {std::clamp(static_cast<std::int32_t>(std::floor(west - 1e-6)), 0, side - 1),
            std::clamp(static_cast<std::int32_t>(std::floor(east + 1e-6)), 0, side - 1)};
  }
};

Facet facet_of(const Earth& earth, const std::array<gpu::MeshPoint, 3>& corners) {
  Facet facet;
  facet.corner = corners;
  std::array<Spot, 3> spot;
  for (std::size_t k = 0; k < 3; ++k) spot[k] = earth.at(corners[k]);
  facet.plane = gpu::plane_of(spot[0].at, spot[1].at, spot[2].at);
  double edge2_m2 = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const proto::Vec3 edge = spot[(k + 1) % 3].at - spot[k].at;
    edge2_m2 = std::max(edge2_m2, proto::dot(edge, edge));
  }
  const auto [low, high] = std::minmax({spot[0].height_m, spot[1].height_m, spot[2].height_m});
  facet.range = gpu::height_range(low, high, edge2_m2, proto::kHeightStep_m);
  return facet;
}

std::array<gpu::MeshPoint, 3> corners_of(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const auto corner = [&](std::uint32_t v) { return gpu::MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
  return {corner(triangle[0]), corner(triangle[1]), corner(triangle[2])};
}

/// The pixels of a tile on the ellipsoid.
class PlacedPixels {
 public:
  PlacedPixels(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t side,
               const std::vector<raster::PixelPoint>& pixels)
      : pixels_(pixels), earth_(lattice, tile), cells_(pixels, side), side_(side) {}

  const raster::PixelPoint& operator[](std::uint32_t k) const { return pixels_[k]; }
  bool crowd() const { return cells_.crowd(); }

  /// f(pixel, error in metres) for those in a triangle, its sides included, until it returns false.
  template <class F>
  void each_error(const std::array<gpu::MeshPoint, 3>& corners, const F& f) const {
    const Facet facet = facet_of(earth_, corners);
    if (!facet.plane.shows()) return;
    const auto [low, high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
    for (std::int32_t row = low; row < std::min(high + 1, side_); ++row) {
      const auto [west, east] = facet.stretch(row, side_);
      for (const std::uint32_t k : cells_.row(row, west, east)) {
        const raster::PixelPoint& pixel = pixels_[k];
        if (!facet.holds(pixel.x, pixel.y)) continue;
        const SurfacePoint place = earth_.place({pixel.x, pixel.y});
        const double surface_m =
            (facet.plane.offset - proto::dot(facet.plane.normal, place.at)) / proto::dot(facet.plane.normal, place.up);
        if (!f(k, std::abs(facet.range.clamp(surface_m) - pixel.height_m))) return;
      }
    }
  }

 private:
  const std::vector<raster::PixelPoint>& pixels_;
  const Earth earth_;
  const PixelsByCell cells_;
  const std::int32_t side_;
};

/// The greater of a triangle's error at samples and at pixels. Where a pixel is too far off, the vertices of the lattice around
/// it are offered: between those three, the lattice itself meets it.
class PixelMeter final : public gpu::ErrorMeter {
 public:
  PixelMeter(const gpu::ErrorMeter& at_samples, const PlacedPixels& pixels, const proto::TileAddress& tile,
             const proto::Lattice& lattice, const proto::Samples& samples)
      : at_samples_(at_samples),
        pixels_(pixels),
        lattice_(lattice),
        samples_(samples),
        west_(lattice.west(tile)),
        south_(lattice.south(tile)),
        side_(static_cast<std::int32_t>(lattice.tile_units(tile.z))) {}

  double error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const override {
    double greatest_m = at_samples_.error_m(corners, asked);
    if (greatest_m > asked.enough_m) return greatest_m;
    pixels_.each_error(corners, [&](std::uint32_t, double error_m) {
      greatest_m = std::max(greatest_m, error_m);
      return greatest_m <= asked.enough_m;
    });
    return greatest_m;
  }

  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override {
    gpu::TriangleError error = at_samples_.measure(corners, limit_m);
    const auto worst = worst_over(corners, error.error_m);
    if (!worst) return error;
    error.error_m = worst->error_m;
    if (worst->error_m <= limit_m) return error;
    error.count = 0;
    offer_around(pixels_[worst->pixel], error);
    return error;
  }

  /// Of the lattice's surface, around the worst pixel.
  std::optional<std::array<gpu::MeshPoint, 3>> wanted(const std::array<gpu::MeshPoint, 3>& corners,
                                                      double limit_m) const override {
    const auto worst = worst_over(corners, limit_m);
    if (!worst) return std::nullopt;
    const raster::PixelPoint& pixel = pixels_[worst->pixel];
    const std::int32_t x = std::min(static_cast<std::int32_t>(pixel.x), side_ - 1),
                       y = std::min(static_cast<std::int32_t>(pixel.y), side_ - 1);
    const auto height = [&](std::uint32_t east, std::uint32_t north) { return sample(west_ + x + east, south_ + y + north); };
    const auto around =
        raster::triangle_around(pixel.x - x, pixel.y - y, height(0, 0) == proto::kNoHeight, height(1, 1) == proto::kNoHeight);
    std::array<gpu::MeshPoint, 3> out;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& [east, north, weight] = around[k];
      out[k] = {x + static_cast<std::int32_t>(east), y + static_cast<std::int32_t>(north), height(east, north)};
    }
    return out;
  }

 private:
  struct Worst {
    std::uint32_t pixel;
    double error_m;
  };
  // Of the pixels that are farther off than that.
  std::optional<Worst> worst_over(const std::array<gpu::MeshPoint, 3>& corners, double least_m) const {
    std::optional<Worst> worst;
    pixels_.each_error(corners, [&](std::uint32_t k, double error_m) {
      if (error_m > (worst ? worst->error_m : least_m)) worst = Worst{k, error_m};
      return true;
    });
    return worst;
  }

  // The nearest first; those that are vertices already are passed over.
  void offer_around(const raster::PixelPoint& pixel, gpu::TriangleError& error) const {
    const auto x = static_cast<std::int32_t>(pixel.x), y = static_cast<std::int32_t>(pixel.y);
    std::array<std::pair<double, gpu::MeshPoint>, 4> around;
    for (std::size_t k = 0; k < 4; ++k) {
      const gpu::MeshPoint at{x + static_cast<std::int32_t>(k & 1), y + static_cast<std::int32_t>(k >> 1), 0};
      around[k] = {std::hypot(at.x - pixel.x, at.y - pixel.y), at};
    }
    std::stable_sort(around.begin(), around.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& [distance, at] : around) {
      if (at.x <= 0 || at.y <= 0 || at.x >= side_ || at.y >= side_) continue;
      at.height = sample(west_ + at.x, south_ + at.y);
      if (at.height != proto::kNoHeight) error.offer(at);
    }
  }

  std::int32_t sample(std::int64_t i, std::int64_t j) const { return sample_at(samples_, lattice_, i, j); }

  const gpu::ErrorMeter& at_samples_;
  const PlacedPixels& pixels_;
  const proto::Lattice& lattice_;
  const proto::Samples& samples_;
  const std::int64_t west_, south_;
  const std::int32_t side_;
};

/// Of a tile. Ground has a handful; noise has thousands, each of which costs a copy of the mesh.
constexpr std::size_t kMostStuck = 256;
/// What mends one triangle may harm another: so often is looked again, while fewer are left, and few at all.
constexpr int kMostRounds = 3;
constexpr std::size_t kMostAgain = 16;

/// Indices of the triangles that are farther than the limit from a pixel.
std::vector<std::uint32_t> triangles_over(const PlacedPixels& pixels, const proto::TileMesh& mesh, double limit_m) {
  std::vector<std::uint32_t> over;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!is_published(mesh, mesh.triangles[t])) continue;
    bool far = false;
    pixels.each_error(corners_of(mesh, mesh.triangles[t]),
                      [&](std::uint32_t, double error_m) { return !(far = error_m > limit_m); });
    if (far) over.push_back(t);
  }
  return over;
}

}  // namespace

proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh,
                                const std::vector<raster::PixelPoint>& pixels) {
  const PlacedPixels placed(lattice, tile, mesh.side, pixels);
  std::vector<std::uint8_t> seen(pixels.size(), 0);
  std::vector<std::uint32_t> counts;
  proto::PixelErrors errors;
  double greatest_m = 0, squares = 0;
  std::uint32_t measured = 0;
  for (const auto& triangle : mesh.triangles) {
    if (!is_published(mesh, triangle)) continue;
    placed.each_error(corners_of(mesh, triangle), [&](std::uint32_t k, double error_m) {
      if (seen[k] != 0) return true;  // on a side that another triangle has, too
      seen[k] = 1;
      greatest_m = std::max(greatest_m, error_m);
      squares += error_m * error_m;
      const std::uint32_t step = pixel_error_step(error_m);
      if (step >= counts.size()) counts.resize(step + 1, 0);
      ++counts[step];
      ++measured;
      return true;
    });
  }
  errors.set_max(greatest_m);
  errors.set_sum_squared(squares);
  errors.set_pixels(measured);
  errors.set_uncovered(static_cast<std::uint32_t>(pixels.size()) - measured);
  const auto first = std::find_if(counts.begin(), counts.end(), [](std::uint32_t n) { return n > 0; });
  errors.set_first(static_cast<std::uint32_t>(first - counts.begin()));
  errors.mutable_counts()->Add(first, counts.end());
  return errors;
}

std::vector<raster::PixelPoint> pixels_of(const proto::Lattice& lattice, const proto::TileAddress& tile, raster::Source& source) {
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z);
  auto pixels = source.pixels(lattice, {west, south, west + side, south + side});
  return pixels.ok() ? std::move(*pixels) : std::vector<raster::PixelPoint>();
}

MetPixels meet_pixels(const LevelContext& context, BuiltTile& built, const std::vector<raster::PixelPoint>& pixels) {
  const PlacedPixels placed(*context.lattice, built.tile, built.mesh.side, pixels);
  if (placed.crowd()) return {};
  const double limit_m = context.level->target() - gpu::kGrace_m;
  std::vector<std::uint32_t> over = triangles_over(placed, built.mesh, limit_m);
  if (over.empty()) return {};
  gpu::SurfaceErrorInput input;
  input.lattice = context.lattice;
  input.tile = built.tile;
  input.mesh = &built.mesh;
  input.samples = context.samples;
  input.ecef_step_m = context.level->ecef_step();
  input.frames = context.frames;
  const std::int32_t step = height_step(*context.level);
  const gpu::SampleMeter samples(input, step);
  const gpu::Upright upright({context.lattice, built.tile, built.mesh.side, context.level->ecef_step()});
  const gpu::UprightMeter in_space(samples, upright);
  const PixelMeter at_pixels(in_space, placed, built.tile, *context.lattice, *context.samples);
  const gpu::SteppedMeter with_pixels(at_pixels, step), samples_alone(in_space, step);
  const auto broken = [&](const proto::TileMesh& mesh) {
    gpu::SurfaceErrorInput asked = input;
    asked.mesh = &mesh;
    std::vector<std::uint32_t> all = gpu::triangles_over(asked, limit_m);
    const std::vector<std::uint32_t> turned = gpu::turned_triangles(upright, mesh);
    all.insert(all.end(), turned.begin(), turned.end());
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  };
  MetPixels met;
  const auto meet = [&] {
    met.on_sides.clear();
    gpu::Refined refined = gpu::refine(built.mesh, with_pixels, limit_m, over, SIZE_MAX);
    met.inserted += refined.inserted;
    for (int round = 0; round < kMostRounds && refined.over > 0; ++round) {
      const std::vector<std::uint32_t> left = triangles_over(placed, built.mesh, limit_m);
      if (left.empty() || left.size() > (round == 0 ? kMostStuck : kMostAgain)) break;
      refined = gpu::refine_stuck(built.mesh, with_pixels, limit_m, left);
      met.inserted += refined.inserted;
      met.on_sides = std::move(refined.on_sides);
    }
  };
  // The promise at samples comes first. What breaks it, steep walls from before too, is mended without a harm to pixels; else,
  // where valences left no room for both, samples alone are asked.
  const auto mend = [&] {  // how many triangles are left that break it
    std::vector<std::uint32_t> left = broken(built.mesh);
    for (const gpu::ErrorMeter* meter : {&with_pixels, &samples_alone}) {
      if (left.empty()) break;
      met.inserted += gpu::refine(built.mesh, *meter, limit_m, left, SIZE_MAX).inserted;
      left = broken(built.mesh);
    }
    return left.size();
  };
  for (int round = 0; round < kMostRounds && !over.empty() && (round == 0 || over.size() <= kMostAgain); ++round) {
    const proto::TileMesh before = built.mesh;
    const std::uint32_t inserted = met.inserted;
    meet();
    // Where that does not help, all stays as it was, and measure_exact mends the walls.
    if (const std::size_t left = mend(); left > 0 && left > broken(before).size()) {
      built.mesh = before;
      met.inserted = inserted;
      break;
    }
    std::vector<std::uint32_t> next = triangles_over(placed, built.mesh, limit_m);
    if (next.size() >= over.size()) break;
    over = std::move(next);
  }
  built.put_back += met.inserted;
  return met;
}

}  // namespace cordillera::pipeline
