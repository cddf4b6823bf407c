#include "pipeline/finest/pixel_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "gpu/measure/sample_meter.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/measure/upright.h"
#include "gpu/mesh/lattice_triangle.h"
#include "gpu/refine/height_step.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/pixel_error_sum.h"
#include "pipeline/tile/sample_at.h"
#include "pipeline/tile/tile_error.h"

namespace cordillera::pipeline {

TilePixels::Facet::Facet(const Corners& corners, const std::array<Spot, 3>& spots, const Poles& poles)
    : plane_(gpu::plane_of(spots[0].at, spots[1].at, spots[2].at)) {
  double edge2_m2 = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const gpu::MeshPoint &a = corners[k], &b = corners[next], &c = corners[(k + 2) % 3];
    const proto::Vec3 edge = spots[next].at - spots[k].at;
    edge2_m2 = std::max(edge2_m2, proto::dot(edge, edge));
    if (poles.fan_out_at(a, b, c)) {
      add_side({c.x, a.y, 0}, {b.x, a.y, 0});
      add_side({b.x, a.y, 0}, b);
    } else if (poles.fan_out_at(b, c, a)) {
      add_side(a, {a.x, b.y, 0});
    } else {
      add_side(a, b);
    }
  }
  std::tie(low_, high_) = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const auto [low_m, high_m] = std::minmax({spots[0].height_m, spots[1].height_m, spots[2].height_m});
  range_ = gpu::height_range(low_m, high_m, edge2_m2, proto::kHeightStep_m);
}

bool TilePixels::Poles::fan_out_at(const gpu::MeshPoint& a, const gpu::MeshPoint& b, const gpu::MeshPoint& c) const {
  const auto alone_on = [&](std::int32_t row) { return a.y == row && b.y != row && c.y != row; };
  return (south && alone_on(0) && b.x > c.x) || (north && alone_on(*north) && b.x < c.x);
}

void TilePixels::Facet::add_side(const gpu::MeshPoint& a, const gpu::MeshPoint& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  side_[sides_++] = {static_cast<double>(a.x), static_cast<double>(a.y), dx, dy, dy == 0 ? 0 : dx / dy,
                     std::min(a.y, b.y),       std::max(a.y, b.y)};
}

TilePixels::TilePixels(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t side,
                       const std::vector<raster::PixelPoint>& pixels)
    : earth_(lattice, tile),
      side_(side),
      poles_{tile.y == 0, tile.y + 1 == proto::tiles_up(tile.z) ? std::optional(side) : std::nullopt},
      start_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) + 2, 0),
      pixels_(pixels.size()) {
  // First each cell's end, at the next but one; then the next one's grows from the cell's start to its end.
  for (const raster::PixelPoint& pixel : pixels) ++start_[cell_of(pixel) + 2];
  for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
  for (const raster::PixelPoint& pixel : pixels) {
    const SurfacePoint place = earth_.place({pixel.x, pixel.y});
    pixels_[start_[cell_of(pixel) + 1]++] = {pixel, place.at, place.up};
  }
}

bool TilePixels::crowd() const {
  constexpr double kMost = 1.5;
  std::size_t cells = 0;
  for (std::size_t k = 1; k < start_.size(); ++k) cells += start_[k] > start_[k - 1] ? 1 : 0;
  return static_cast<double>(pixels_.size()) > kMost * static_cast<double>(cells);
}

void TilePixels::see(const proto::TileMesh& mesh) {
  seen_.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < seen_.size(); ++t) {
    const auto corner = [&](std::uint32_t v) { return gpu::MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
    const auto& [a, b, c] = mesh.triangles[t];
    const Corners corners{corner(a), corner(b), corner(c)};
    if (!is_published(mesh, mesh.triangles[t]) || corners == seen_[t].corners) continue;
    Seen seen{corners, static_cast<std::uint32_t>(errors_.size())};
    each_error(corners, [&](std::uint32_t pixel, double error_m) {
      errors_.push_back({pixel, error_m});
      seen.greatest_m = std::max(seen.greatest_m, error_m);
      return true;
    });
    seen.end = static_cast<std::uint32_t>(errors_.size());
    seen_[t] = seen;
  }
}

std::vector<std::uint32_t> TilePixels::triangles_over(const proto::TileMesh& mesh, double limit_m) {
  see(mesh);
  std::vector<std::uint32_t> over;
  for (std::uint32_t t = 0; t < seen_.size(); ++t) {
    if (seen_[t].greatest_m > limit_m && is_published(mesh, mesh.triangles[t])) over.push_back(t);
  }
  return over;
}

proto::PixelErrors TilePixels::errors(const proto::TileMesh& mesh) {
  see(mesh);
  constexpr double kUncovered = -1;
  std::vector<double> of_pixel_m(pixels_.size(), kUncovered);
  std::vector<std::uint32_t> counts;
  for (std::size_t t = 0; t < seen_.size(); ++t) {
    if (!is_published(mesh, mesh.triangles[t])) continue;
    for (std::uint32_t k = seen_[t].first; k < seen_[t].end; ++k)
      of_pixel_m[errors_[k].pixel] = std::max(of_pixel_m[errors_[k].pixel], errors_[k].error_m);
  }
  proto::PixelErrors errors;
  double greatest_m = 0, squares = 0;
  std::uint32_t measured = 0;
  for (const double error_m : of_pixel_m) {
    if (error_m == kUncovered) continue;
    greatest_m = std::max(greatest_m, error_m);
    squares += error_m * error_m;
    const std::uint32_t step = pixel_error_step(error_m);
    if (step >= counts.size()) counts.resize(step + 1, 0);
    ++counts[step];
    ++measured;
  }
  errors.set_max(greatest_m);
  errors.set_sum_squared(squares);
  errors.set_pixels(measured);
  errors.set_uncovered(static_cast<std::uint32_t>(pixels_.size()) - measured);
  const auto first = std::find_if(counts.begin(), counts.end(), [](std::uint32_t n) { return n > 0; });
  errors.set_first(static_cast<std::uint32_t>(first - counts.begin()));
  errors.mutable_counts()->Add(first, counts.end());
  return errors;
}

namespace {

/// The greater of a triangle's error at samples and at pixels. Where a pixel is too far off, the vertices of the lattice around
/// it are offered: between those three, the lattice itself meets it.
class PixelMeter final : public gpu::ErrorMeter {
 public:
  PixelMeter(const gpu::ErrorMeter& at_samples, const TilePixels& pixels, const proto::TileAddress& tile,
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
    if (offer_around(pixels_[worst->pixel], error) == Around::some_void && error.count < kCorners)
      offer_within(corners, pixels_[worst->pixel], error);
    return error;
  }

  /// Of the lattice's surface, around the worst pixel; else what samples want.
  std::optional<std::array<gpu::MeshPoint, 3>> wanted(const std::array<gpu::MeshPoint, 3>& corners,
                                                      double limit_m) const override {
    const auto worst = worst_over(corners, limit_m);
    if (!worst) return at_samples_.wanted(corners, limit_m);
    const raster::PixelPoint& pixel = pixels_[worst->pixel];
    const std::int32_t x = std::min(static_cast<std::int32_t>(pixel.x), side_ - 1),
                       y = std::min(static_cast<std::int32_t>(pixel.y), side_ - 1);
    return gpu::lattice_triangle(x, y, pixel.x - x, pixel.y - y,
                                 [&](std::int32_t east, std::int32_t north) { return sample(west_ + east, south_ + north); });
  }

 private:
  static constexpr int kCorners = 4;  // of a cell
  enum class Around { valid, some_void };
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
  Around offer_around(const raster::PixelPoint& pixel, gpu::TriangleError& error) const {
    const auto x = static_cast<std::int32_t>(pixel.x), y = static_cast<std::int32_t>(pixel.y);
    std::array<std::pair<double, gpu::MeshPoint>, kCorners> around;
    for (std::size_t k = 0; k < kCorners; ++k) {
      const gpu::MeshPoint at{x + static_cast<std::int32_t>(k & 1), y + static_cast<std::int32_t>(k >> 1), 0};
      around[k] = {std::hypot(at.x - pixel.x, at.y - pixel.y), at};
    }
    std::stable_sort(around.begin(), around.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Around found = Around::valid;
    for (auto& [distance, at] : around) {
      at.height = sample(west_ + at.x, south_ + at.y);
      if (at.height == proto::kNoHeight)
        found = Around::some_void;
      else if (at.x > 0 && at.y > 0 && at.x < side_ && at.y < side_)
        error.offer(at);
    }
    return found;
  }

  // Where some of those have no data: the nearest sample in the triangle, which then leaves a smaller one on the rim.
  void offer_within(const std::array<gpu::MeshPoint, 3>& corners, const raster::PixelPoint& pixel,
                    gpu::TriangleError& error) const {
    constexpr std::int32_t kReach = 8;
    const auto x = static_cast<std::int32_t>(pixel.x), y = static_cast<std::int32_t>(pixel.y);
    std::optional<std::pair<double, gpu::MeshPoint>> nearest;
    for (gpu::MeshPoint at{0, y - kReach, 0}; at.y <= y + kReach; ++at.y) {
      for (at.x = x - kReach; at.x <= x + kReach; ++at.x) {
        const double distance = std::hypot(at.x - pixel.x, at.y - pixel.y);
        if ((nearest && distance >= nearest->first) || !is_inside(corners, at)) continue;
        at.height = sample(west_ + at.x, south_ + at.y);
        if (at.height != proto::kNoHeight) nearest = {distance, at};
      }
    }
    if (nearest) error.offer(nearest->second);
  }
  static bool is_inside(const std::array<gpu::MeshPoint, 3>& c, const gpu::MeshPoint& p) {
    return gpu::twice_area(c[0], c[1], p) > 0 && gpu::twice_area(c[1], c[2], p) > 0 && gpu::twice_area(c[2], c[0], p) > 0;
  }

  std::int32_t sample(std::int64_t i, std::int64_t j) const { return sample_at(samples_, lattice_, i, j); }

  const gpu::ErrorMeter& at_samples_;
  const TilePixels& pixels_;
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

}  // namespace

std::vector<raster::PixelPoint> pixels_of(const proto::Lattice& lattice, const proto::TileAddress& tile, raster::Source& source) {
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z);
  auto pixels = source.pixels(lattice, {west, south, west + side, south + side});
  return pixels.ok() ? std::move(*pixels) : std::vector<raster::PixelPoint>();
}

MetPixels meet_pixels(const LevelContext& context, BuiltTile& built, TilePixels& pixels, gpu::SurfaceMemory& memory) {
  if (pixels.crowd()) return {};
  const double limit_m = limit_of(context, built.tile);
  std::vector<std::uint32_t> over = pixels.triangles_over(built.mesh, limit_m);
  if (over.empty()) return {};
  const gpu::SurfaceErrorInput input = surface_input(context, built);
  const std::int32_t step = height_step(*context.level);
  const gpu::SampleMeter samples(input, step);
  const gpu::Upright upright({context.lattice, built.tile, built.mesh.side, ecef_steps(*context.level)});
  const gpu::UprightMeter in_space(samples, upright);
  const PixelMeter at_pixels(in_space, pixels, built.tile, *context.lattice, *context.samples);
  const gpu::SteppedMeter with_pixels(at_pixels, step), samples_alone(in_space, step);
  const auto broken = [&](const proto::TileMesh& mesh) {
    gpu::SurfaceErrorInput asked = input;
    asked.mesh = &mesh;
    return in_either(gpu::triangles_over(gpu::surface_error(asked, limit_m, memory)), gpu::turned_triangles(upright, mesh));
  };
  MetPixels met;
  const auto meet = [&] {
    met.on_sides.clear();
    gpu::Refined refined = gpu::refine(built.mesh, with_pixels, limit_m, over, SIZE_MAX);
    met.inserted += refined.inserted;
    for (int round = 0; round < kMostRounds && refined.over > 0; ++round) {
      const std::vector<std::uint32_t> left = pixels.triangles_over(built.mesh, limit_m);
      if (left.empty() || left.size() > (round == 0 ? kMostStuck : kMostAgain)) break;
      refined = gpu::refine_stuck(built.mesh, with_pixels, limit_m, left);
      met.inserted += refined.inserted;
      met.on_sides = std::move(refined.on_sides);
      if (refined.over == left.size()) break;  // not one could be made, so nothing is different
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
    const MetPixels met_before = met;
    meet();
    // Where that does not help, all stays as it was, and measure_exact mends the walls.
    if (const std::size_t left = mend(); left > 0 && left > broken(before).size()) {
      built.mesh = before;
      met = met_before;
      break;
    }
    met.changed = met.changed || built.mesh.triangles != before.triangles;
    std::vector<std::uint32_t> next = pixels.triangles_over(built.mesh, limit_m);
    if (next.size() >= over.size()) break;
    over = std::move(next);
  }
  built.put_back += met.inserted;
  return met;
}

}  // namespace cordillera::pipeline
