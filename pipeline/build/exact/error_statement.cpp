#include "pipeline/build/exact/error_statement.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "gpu/exact/steps/triangle.h"
#include "gpu/measure/surface_meter.h"
#include "gpu/measure/upright_flips.h"
#include "gpu/refine/height_step.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_error.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr double kWide_deg = 6;        // of longitude
constexpr double kBesidePole_deg = 2;  // of latitude

/// What is looked at for the RMSE: every so many samples both ways, and no more than this of what a tile shows.
constexpr int kRmseStep = 4, kRmseSide = 1024;

/// The longer side of what is published, units: of a coarse tile that may be little.
std::int32_t published_side(const proto::TileMesh& mesh) {
  std::int32_t west = mesh.side, south = mesh.side, east = 0, north = 0;
  for (const auto& triangle : mesh.triangles) {
    if (!is_published(mesh, triangle)) continue;
    for (const std::uint32_t v : triangle) {
      west = std::min(west, mesh.x[v]), east = std::max(east, mesh.x[v]);
      south = std::min(south, mesh.y[v]), north = std::max(north, mesh.y[v]);
    }
  }
  return std::max({east - west, north - south, 0});
}

/// Rows of a ground, the last one included.
struct Rows {
  int first = 0, last = 0;
};

/// Squares of a published triangle's errors, at every step-th sample both ways. A sample on an edge belongs to the triangle east
/// of it, or north.
void add_squares(const gpu::exact::Triangle& t, const gpu::exact::Field& field, int step, const Rows& rows,
                 gpu::SurfaceError& error) {
  for (int y = (std::max(t.south, rows.first) + step - 1) / step * step; y <= std::min(t.north, rows.last); y += step) {
    for (int x = (t.west + step - 1) / step * step; x <= t.east; x += step) {
      if (!t.owns(x, y, 1, 1) || field.is_void_there(x, y)) continue;
      const double off_m =
          static_cast<double>(t.height_above(static_cast<float>(x), static_cast<float>(y), field.height_at(x, y))) *
          proto::kHeightStep_m;
      error.sum_squared_m2 += off_m * off_m;
      ++error.samples;
    }
  }
}

gpu::SurfaceError measured_squares(const GroundMeter& known, int step, const Rows& rows, const proto::TileMesh& mesh) {
  gpu::SurfaceError error;
  const auto corner = [&](std::uint32_t v) {
    const auto [x, y] = known.on_ground(mesh.x[v], mesh.y[v]);
    return gpu::exact::Corner{x, y, static_cast<float>(mesh.height[v]), false};
  };
  for (const auto& t : mesh.triangles) {
    const auto [south, north] = std::minmax({mesh.y[t[0]], mesh.y[t[1]], mesh.y[t[2]]});
    if (known.on_ground(0, north).second < rows.first || known.on_ground(0, south).second > rows.last) continue;
    add_squares(gpu::exact::make_triangle(corner(t[0]), corner(t[1]), corner(t[2]), {0, 0, known.field().curve}), known.field(),
                step, rows, error);
  }
  return error;
}

double slope_of(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& t, double unit_m) {
  const auto [low, high] = std::minmax({mesh.height[t[0]], mesh.height[t[1]], mesh.height[t[2]]});
  const double ux = mesh.x[t[1]] - mesh.x[t[0]], uy = mesh.y[t[1]] - mesh.y[t[0]], vx = mesh.x[t[2]] - mesh.x[t[0]],
               vy = mesh.y[t[2]] - mesh.y[t[0]];
  const double longest =
      std::sqrt(std::max({ux * ux + uy * uy, vx * vx + vy * vy, (ux - vx) * (ux - vx) + (uy - vy) * (uy - vy)}));
  return (high - low) * proto::kHeightStep_m * longest / ((ux * vy - uy * vx) * unit_m);
}

/// Triangles so steep, or so narrow, that points rounded sideways may move them by more than was set aside: a cell is as narrow
/// as on the row of the triangle that is nearest to a pole, where all are. And those so wide, in degrees, that what the engine
/// knows of the earth's curve, by its second order, is not enough: there are such beside poles.
std::vector<std::uint32_t> steep_triangles(const proto::Lattice& lattice, const BuiltTile& tile) {
  const std::int64_t south = lattice.south(tile.tile);
  const auto unit_of = [&](std::int32_t y) {
    return proto::cell_height_m(lattice, south + y) * std::max(proto::row_frame(lattice, south + y).cos_lat, 0.0);
  };
  std::vector<std::uint32_t> steep;
  for (std::uint32_t t = 0; t < tile.mesh.triangles.size(); ++t) {
    const auto& c = tile.mesh.triangles[t];
    const auto [low, high] = std::minmax({tile.mesh.y[c[0]], tile.mesh.y[c[1]], tile.mesh.y[c[2]]});
    const double unit = std::min(unit_of(low), unit_of(high));
    const auto [west, east] = std::minmax({tile.mesh.x[c[0]], tile.mesh.x[c[1]], tile.mesh.x[c[2]]});
    const bool is_wide = (east - west) * lattice.cell_deg() > kWide_deg;
    const std::int64_t to_pole = std::min(south + low, lattice.rows() - south - high);
    const bool is_beside_pole = static_cast<double>(to_pole) * lattice.cell_deg() < kBesidePole_deg;
    if (is_wide || is_beside_pole || !(slope_of(tile.mesh, c, unit) <= kMildSlope)) steep.push_back(t);
  }
  return steep;
}

using Corners = std::array<gpu::MeshPoint, 3>;

Corners corners_of(const proto::TileMesh& mesh, std::uint32_t t) {
  Corners corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = mesh.triangles[t][k];
    corners[k] = {mesh.x[v], mesh.y[v], mesh.height[v]};
  }
  return corners;
}

constexpr std::size_t kPiece = 64;  ///< steep triangles
constexpr std::size_t kBands = 16;  ///< of a tile that is so many rows high; sums depend on it

GroundMeter meter_of(const LevelContext& context, const KnownGround& ground, const BuiltTile& tile) {
  return {{context.lattice, tile.tile, tile.mesh.side, ecef_steps(*context.level), height_step(*context.level)}, ground};
}

/// Triangles of a mesh, and how far off they are, as long as they stay what they are. measured: those of which that is known
/// alone; of others it is 0, for their bounds hold.
class KnownErrors {
 public:
  KnownErrors(const proto::TileMesh& mesh, const std::vector<std::uint32_t>& measured, const std::vector<double>& error_m) {
    std::vector<double> all(mesh.triangles.size(), 0);
    for (std::size_t k = 0; k < measured.size(); ++k) all[measured[k]] = error_m[k];
    for (std::uint32_t t = 0; t < all.size(); ++t) error_m_.emplace_back(corners_of(mesh, t), all[t]);
    std::sort(error_m_.begin(), error_m_.end(), before);
  }
  std::optional<double> find(const Corners& corners) const {
    const auto found = std::lower_bound(error_m_.begin(), error_m_.end(), Known{corners, 0}, before);
    return found != error_m_.end() && key(found->first) == key(corners) ? std::optional(found->second) : std::nullopt;
  }

 private:
  using Known = std::pair<Corners, double>;
  static std::array<std::int32_t, 9> key(const Corners& c) {
    return {c[0].x, c[0].y, c[0].height, c[1].x, c[1].y, c[1].height, c[2].x, c[2].y, c[2].height};
  }
  static bool before(const Known& a, const Known& b) { return key(a.first) < key(b.first); }

  std::vector<Known> error_m_;
};

}  // namespace

ErrorStatement::ErrorStatement(const LevelContext& context, const KnownGround& known, BuiltTile& tile, int rmse_step)
    : context_(context),
      tile_(tile),
      known_(meter_of(context, known, tile)),
      steep_(steep_triangles(*context.lattice, tile)),
      error_m_(steep_.size()),
      step_(rmse_step) {}

std::size_t ErrorStatement::pieces() const { return (steep_.size() + kPiece - 1) / kPiece; }

void ErrorStatement::measure(std::size_t piece) {
  const double limit_m = limit_of(context_, tile_.tile);
  for (std::size_t k = piece * kPiece; k < std::min(steep_.size(), (piece + 1) * kPiece); ++k)
    error_m_[k] = known_.error_m(corners_of(tile_.mesh, steep_[k]), limit_m);
}

// A tile takes no more vertices than it has, or so many: around a pole, where columns are millimetres apart, it would have more
// triangles than all tiles below it, and still be over its target. What is left is stated.
constexpr std::size_t kPutBackAtLeast = 256;

void ErrorStatement::put_back() {
  const gpu::EcefSteps steps = ecef_steps(*context_.level);
  const double limit_m = limit_of(context_, tile_.tile);
  const gpu::Upright upright({context_.lattice, tile_.tile, tile_.mesh.side, steps});
  tile_.composed = true;
  const auto [low_m, high_m] = gpu::height_range_m(tile_.mesh);
  tile_.max_error_m += steps.between(low_m, high_m) * (1 + kMildSlope);
  double steep_m = 0;
  bool over = false;
  for (const double error_m : error_m_) {
    steep_m = std::max(steep_m, error_m);
    over = over || error_m > limit_m;
  }
  if (context_.put_back && (over || !gpu::turned_triangles(upright, tile_.mesh).empty())) {
    const KnownErrors before(tile_.mesh, steep_, error_m_);
    const gpu::UprightMeter in_space(known_, upright);
    const gpu::SteppedMeter meter(in_space, height_step(*context_.level));
    const auto measured = [&] {  // those over the limit; whatever is new is looked at
      std::vector<std::uint32_t> left;
      steep_m = 0;
      for (std::uint32_t t = 0; t < tile_.mesh.triangles.size(); ++t) {
        if (!is_published(tile_.mesh, tile_.mesh.triangles[t])) continue;
        const Corners corners = corners_of(tile_.mesh, t);
        const std::optional<double> known = before.find(corners);
        const double error_m = known ? *known : known_.error_m(corners, limit_m);
        if (error_m > limit_m) left.push_back(t);
        steep_m = std::max(steep_m, error_m);
      }
      return left;
    };
    // Needles first: what is turned needs no vertex.
    gpu::flip_turned(tile_.mesh, upright, known_, limit_m);
    std::vector<std::uint32_t> wrong = measured();
    const std::vector<std::uint32_t> turned = gpu::turned_triangles(upright, tile_.mesh);
    wrong.insert(wrong.end(), turned.begin(), turned.end());
    std::sort(wrong.begin(), wrong.end());
    wrong.erase(std::unique(wrong.begin(), wrong.end()), wrong.end());
    if (!wrong.empty()) {
      const gpu::Refined refined =
          gpu::refine(tile_.mesh, meter, limit_m, wrong, std::max(kPutBackAtLeast, tile_.mesh.vertices()));
      tile_.put_back = refined.inserted;
      if (refined.over > 0) {
        const std::vector<std::uint32_t> left = measured();
        if (left.size() <= kMostLeftOver) tile_.put_back += gpu::refine_stuck(tile_.mesh, meter, limit_m, left).inserted;
      }
      gpu::flip_turned(tile_.mesh, upright, known_, limit_m);
      measured();
    }
  }
  tile_.max_error_m = std::max(tile_.max_error_m, steep_m) + gpu::kGrace_m;
  if (step_ == 0) step_ = std::max(kRmseStep, published_side(tile_.mesh) / kRmseSide);
  bands_.resize(kBands);
}

std::size_t ErrorStatement::bands() const { return bands_.size(); }

void ErrorStatement::measure_band(std::size_t band) {
  const auto row = [&](std::size_t k) {
    const std::int64_t high = tile_.mesh.side + 1;
    return known_.on_ground(0, static_cast<std::int32_t>(high * static_cast<std::int64_t>(k) / kBands)).second;
  };
  bands_[band] = measured_squares(known_, step_, {row(band), row(band + 1) - 1}, tile_.mesh);
}

void ErrorStatement::finish() {
  for (const gpu::SurfaceError& band : bands_) {
    tile_.measured.sum_squared_m2 += band.sum_squared_m2;
    tile_.measured.samples += band.samples;
  }
}

void state_errors(const LevelContext& context, const KnownGround& known, const gpu::ParallelFor& parallel,
                  std::vector<BuiltTile>& tiles, int rmse_step) {
  std::vector<std::unique_ptr<ErrorStatement>> statements(tiles.size());
  parallel(tiles.size(),
           [&](std::size_t k) { statements[k] = std::make_unique<ErrorStatement>(context, known, tiles[k], rmse_step); });
  const auto each_part = [&](std::size_t (ErrorStatement::*count)() const, void (ErrorStatement::*measure)(std::size_t)) {
    std::vector<std::pair<ErrorStatement*, std::size_t>> parts;
    for (const auto& statement : statements) {
      for (std::size_t part = 0; part < (*statement.*count)(); ++part) parts.emplace_back(statement.get(), part);
    }
    parallel(parts.size(), [&](std::size_t n) { (parts[n].first->*measure)(parts[n].second); });
  };
  each_part(&ErrorStatement::pieces, &ErrorStatement::measure);
  parallel(tiles.size(), [&](std::size_t k) { statements[k]->put_back(); });
  each_part(&ErrorStatement::bands, &ErrorStatement::measure_band);
  parallel(tiles.size(), [&](std::size_t k) { statements[k]->finish(); });
}

}  // namespace cordillera::pipeline
