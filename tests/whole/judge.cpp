#include "tests/whole/judge.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/plan/plan.h"
#include "tests/whole/laws.h"

namespace cordillera::whole {
namespace {

constexpr double kGrace_m = 0.001;       // this evaluator's trigonometry is not the builder's
constexpr double kLooseGrace_m = 0.005;  // the builder's own grace, and quantisation of both faces

std::string name(const proto::TileAddress& t) {
  return std::to_string(t.z) + "/" + std::to_string(t.x) + "/" + std::to_string(t.y);
}

/// Samples of the tile's rectangle that lie inside the data's window, and `room` more around; columns near the tile's own.
SampleWindow data_window(const Built& built, const proto::TileAddress& tile, std::int64_t room) {
  const proto::Lattice& lattice = built.lattice;
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z),
                     circle = lattice.columns();
  const proto::Samples& s = built.samples;
  SampleWindow window{west - room, std::max(south - room, s.south), west + side + room,
                      std::min(south + side + room, s.south + s.rows - 1)};
  SampleWindow best = window;
  best.east = best.west - 1;
  int parts = 0;
  for (int turn = -2; turn <= 2; ++turn) {
    SampleWindow part = window;
    part.west = std::max(part.west, s.west + turn * circle);
    part.east = std::min(part.east, s.west + s.columns - 1 + turn * circle);
    if (part.west > part.east) continue;
    ++parts;
    if (part.east - part.west > best.east - best.west) best = part;
  }
  return parts > 1 ? window : best;
}

bool without_holes(const Built& built, const proto::TileAddress& tile) {
  const std::int64_t west = built.lattice.west(tile), south = built.lattice.south(tile), side = built.lattice.tile_units(tile.z);
  if (side > built.samples.columns || side > built.samples.rows) return false;
  for (std::int64_t j = south; j <= south + side; ++j)
    for (std::int64_t i = west; i <= west + side; ++i)
      if (!built.truth(i, j)) return false;
  return true;
}

/// How many places without data are within a cell of one: counted in advance, rectangle by rectangle.
class Voids {
 public:
  Voids(const Built& built, std::int64_t cell)
      : built_(built), cell_(cell), columns_(built.samples.columns + 2 * cell), rows_(built.samples.rows + 2 * cell) {
    if (everywhere()) return;
    sum_.assign(static_cast<std::size_t>((columns_ + 1) * (rows_ + 1)), 0);
    for (std::int64_t r = 0; r < rows_; ++r)
      for (std::int64_t c = 0; c < columns_; ++c) {
        const std::int64_t j = built.samples.south - cell + r;
        const bool none = j >= 0 && j <= built.lattice.rows() && !built.truth(built.samples.west - cell + c, j);
        at(c + 1, r + 1) = at(c, r + 1) + at(c + 1, r) - at(c, r) + (none ? 1 : 0);
      }
  }
  /// The data is too narrow for the cell.
  bool everywhere() const { return built_.samples.columns <= 2 * cell_; }
  bool near(std::int64_t i, std::int64_t j) const {
    std::int64_t c = i - built_.samples.west;
    const std::int64_t r = j - built_.samples.south;
    if (c < 0 || c >= built_.samples.columns) {
      const std::int64_t circle = built_.lattice.columns();
      c = (c % circle + circle) % circle;
    }
    if (c >= built_.samples.columns || r < 0 || r >= built_.samples.rows) return true;
    const std::int64_t across = 2 * cell_ + 1;
    return at(c + across, r + across) - at(c, r + across) - at(c + across, r) + at(c, r) > 0;
  }

 private:
  std::int32_t& at(std::int64_t c, std::int64_t r) { return sum_[static_cast<std::size_t>(r * (columns_ + 1) + c)]; }
  std::int32_t at(std::int64_t c, std::int64_t r) const { return sum_[static_cast<std::size_t>(r * (columns_ + 1) + c)]; }

  const Built& built_;
  std::int64_t cell_, columns_, rows_;
  std::vector<std::int32_t> sum_;
};

Holes holes_of(const Built& built, const proto::TileAddress& tile) {
  return without_holes(built, tile) ? Holes::none : Holes::allowed;
}

/// Eastern, northern and the two diagonal neighbours to the north: with these, every pair is met once.
std::set<proto::TileAddress> neighbours(const proto::TileAddress& t) {
  const std::int32_t across = proto::tiles_across(t.z);
  const std::int32_t east = (t.x + 1) % across, west = (t.x + across - 1) % across;
  return {{t.z, east, t.y}, {t.z, t.x, t.y + 1}, {t.z, east, t.y + 1}, {t.z, west, t.y + 1}};
}

using Millimetres = std::array<std::int64_t, 3>;
Millimetres rounded(const Point& p) { return {std::llround(p[0] * 1000), std::llround(p[1] * 1000), std::llround(p[2] * 1000)}; }

/// The surface and what touches it of its neighbours: a chord of the border may bend away from it, so that a neighbour shows the
/// samples between.
DecodedSurface with_neighbours(const DecodedSurface& own, const std::vector<DecodedSurface>& others) {
  DecodedSurface all = own;
  std::set<Millimetres> mine;
  for (const Point& p : own.points) mine.insert(rounded(p));
  for (const DecodedSurface& other : others) {
    for (const auto& c : other.triangles) {
      const bool touches =
          std::any_of(c.begin(), c.end(), [&](std::uint32_t k) { return mine.contains(rounded(other.points[k])); });
      if (!touches) continue;
      const auto first = static_cast<std::uint32_t>(all.points.size());
      for (const std::uint32_t k : c) all.points.push_back(other.points[k]);
      all.triangles.push_back({first, first + 1, first + 2});
    }
  }
  return all;
}

enum class Face { drc, glb };
const char* name(Face face) { return face == Face::drc ? ".drc" : ".glb"; }
DecodedSurface surface(const BuiltTile& tile, Face face) { return face == Face::drc ? surface_of(tile.drc) : tile.glb; }

std::vector<DecodedSurface> around(const Level& level, const proto::TileAddress& tile, Face face) {
  std::vector<DecodedSurface> found;
  const std::int32_t across = proto::tiles_across(tile.z);
  for (std::int32_t dy = -1; dy <= 1; ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      const auto other = level.find({tile.z, (tile.x + dx + across) % across, tile.y + dy});
      if ((dx != 0 || dy != 0) && other != level.end()) found.push_back(surface(other->second, face));
    }
  }
  return found;
}

struct TileErrors {
  double max_m = 0;
  std::uint64_t samples = 0;
};

TileErrors judge_tile(const Built& built, const Level& level, const BuiltTile& tile, std::int64_t samples_a_tile,
                      Findings& found) {
  const proto::TileAddress at = tile.drc.tile;
  const auto truth = [&](std::int64_t i, std::int64_t j) { return built.truth(i, j); };
  TileErrors errors;
  // One cell of the level around: chords of the poleward side bulge over it.
  const SampleWindow window = data_window(built, at, built.lattice.cell_units(at.z));
  const double count = static_cast<double>(window.east - window.west + 1) * static_cast<double>(window.north - window.south + 1);
  const auto stride = static_cast<std::int64_t>(std::ceil(std::sqrt(std::max(1.0, count / static_cast<double>(samples_a_tile)))));
  for (const Face face : {Face::drc, Face::glb}) {
    const DecodedSurface own = surface(tile, face);
    const Measured measured = measure(own, built.lattice, at, truth, window, stride);
    errors.max_m = std::max(errors.max_m, measured.max_m);
    errors.samples += measured.samples;
    if (measured.max_m > tile.record.max_error() + kGrace_m)
      found.push_back(name(at) + name(face) + " states " + std::to_string(tile.record.max_error()) + " m, but is " +
                      std::to_string(measured.max_m) + " m off at (" + std::to_string(measured.worst_i) + ", " +
                      std::to_string(measured.worst_j) + ")");
    if (holes_of(built, at) == Holes::allowed) continue;
    const SampleWindow inside = data_window(built, at, 0);
    const Measured all = measure(with_neighbours(own, around(level, at, face)), built.lattice, at, truth, inside, stride);
    if (all.uncovered > 0)
      found.push_back(name(at) + name(face) + " leaves " + std::to_string(all.uncovered) + " samples unseen");
  }
  return errors;
}

/// With two corners there: lines in space, which the .glb leaves out.
std::size_t lines_at_pole(const Built& built, const DecodedTile& tile) {
  const std::int64_t south = built.lattice.south(tile.tile), rows = built.lattice.rows();
  std::size_t lines = 0;
  for (const auto& c : tile.triangles) {
    int there = 0;
    for (const std::uint32_t k : c) there += south + tile.v[k] == 0 || south + tile.v[k] == rows ? 1 : 0;
    lines += there > 1 ? 1 : 0;
  }
  return lines;
}

}  // namespace

Findings judge_neighbours(const Built& built) {
  Findings found;
  for (const auto& [z, level] : built.levels) {
    const gpu::EcefSteps steps = pipeline::ecef_steps(pipeline::level_plan(built.plan, z));
    const StepOf step_of = [&](double height_m) { return steps.between(height_m, height_m); };
    for (const auto& [at, tile] : level) {
      for (const proto::TileAddress& beside : neighbours(at)) {
        const auto other = level.find(beside);
        if (other == level.end()) continue;
        const bool whole = without_holes(built, at) && without_holes(built, beside);
        if (Violation v = neighbour_violation(tile.drc, other->second.drc, whole ? Holes::none : Holes::allowed))
          found.push_back(*v);
        const BothFaces a{tile.drc, tile.glb.points}, b{other->second.drc, other->second.glb.points};
        if (Violation v = glb_neighbour_violation(a, b, step_of)) found.push_back(*v);
      }
    }
  }
  return found;
}

Findings judge_plans(const Built& built) {
  Findings found;
  for (const auto& [z, level] : built.levels) {
    for (const auto& [at, tile] : level) {
      const Holes holes = holes_of(built, at);
      if (Violation v = plan_violation(tile.drc, holes)) found.push_back(*v);
      if (Violation v = manifold_violation(tile.drc, holes)) found.push_back(*v);
      if (tile.drc.triangles.size() != tile.glb.triangles.size() + lines_at_pole(built, tile.drc))
        found.push_back(name(at) + ": its two faces differ in triangles");
      if (Violation v = space_violation(tile.glb)) found.push_back(name(at) + ": " + *v);
      for (std::size_t k = 0; k < tile.drc.u.size(); ++k) {
        const std::int64_t i = built.lattice.west(at) + tile.drc.u[k], j = built.lattice.south(at) + tile.drc.v[k];
        if (built.truth(i, j)) continue;
        found.push_back(name(at) + ": a vertex at (" + std::to_string(i) + ", " + std::to_string(j) + "), where no data is");
        break;
      }
    }
  }
  return found;
}

Findings judge_errors(const Built& built, const ErrorRules& rules) {
  Findings found;
  for (const auto& [z, level] : built.levels) {
    const bool finest = z == built.lattice.finest_level;
    const double target_m = built.plan.levels(built.lattice.finest_level - z).target();
    double max_m = 0, stated_m = 0;
    for (const auto& [at, tile] : level) {
      TileErrors errors = judge_tile(built, level, tile, rules.samples_a_tile, found);
      // Of a corner of the data every third sample may miss all that is shown.
      if (errors.samples == 0 && finest) errors = judge_tile(built, level, tile, std::int64_t{1} << 40, found);
      max_m = std::max(max_m, errors.max_m);
      stated_m = std::max(stated_m, tile.record.max_error());
      if (errors.samples == 0 && finest) found.push_back(name(at) + " shows no sample at all");
      if (built.plan.promise() && tile.record.max_error() > target_m)
        found.push_back(name(at) + " states " + std::to_string(tile.record.max_error()) + " m, more than the target " +
                        std::to_string(target_m));
    }
    if (rules.slack > 0 && finest && stated_m > rules.slack * max_m + kLooseGrace_m)
      found.push_back("level " + std::to_string(z) + " states " + std::to_string(stated_m) + " m, but is only " +
                      std::to_string(max_m) + " m off");
  }
  return found;
}

Findings judge_cover(const Built& built) {
  Findings found;
  for (const auto& [z, level] : built.levels) {
    const Voids voids(built, built.lattice.cell_units(z));
    if (voids.everywhere()) continue;
    for (const auto& [at, tile] : level) {
      const SampleWindow w = data_window(built, at, 0);
      const std::int64_t west = built.lattice.west(at), south = built.lattice.south(at);
      const Shown shown{w.west - west, w.south - south, w.east - west, w.north - south,
                        [&](std::int64_t u, std::int64_t v) { return !voids.near(west + u, south + v); }};
      if (Violation v = cover_violation(tile.drc, shown)) found.push_back(*v);
    }
  }
  return found;
}

Findings judge(const Built& built, const ErrorRules& rules) {
  Findings found = judge_plans(built);
  for (const Findings& more : {judge_neighbours(built), judge_errors(built, rules), judge_cover(built)})
    found.insert(found.end(), more.begin(), more.end());
  for (const auto& [z, level] : built.levels)
    if (level.empty()) found.push_back("level " + std::to_string(z) + " has no tile");
  return found;
}

}  // namespace cordillera::whole
