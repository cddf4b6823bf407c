#include "gpu/fit/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace cordillera::gpu::fit {
namespace {

struct MinMax {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double size() const { return high - low; }
};

MinMax range_of(const std::vector<double>& values) {
  MinMax range;
  for (const double value : values) range.add(value);
  return range;
}

/// The least distance along an axis between neighbours, but for noise: the pitch, if there is one.
double pitch_of(const HeightMesh& mesh, const std::vector<double>& along, double extent) {
  double pitch = extent;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double gap = std::abs(along[t[k]] - along[t[(k + 1) % 3]]);
      if (gap > extent * 1e-6 && gap < pitch) pitch = gap;
    }
  }
  return pitch;
}

struct Lattice {
  std::int32_t columns = 0, rows = 0;
  std::vector<std::uint32_t> node;  ///< indexed by vertex, row-major
};

/// The vertices as nodes of a regular lattice of which they fill at least a quarter; no columns if they are none.
Lattice find_lattice(const HeightMesh& mesh, const MinMax& x, const MinMax& y) {
  const double step_x = pitch_of(mesh, mesh.x, x.size()), step_y = pitch_of(mesh, mesh.y, y.size());
  const double columns = std::round(x.size() / step_x) + 1, rows = std::round(y.size() / step_y) + 1;
  if (columns * rows > 4.0 * static_cast<double>(mesh.vertices()) || columns > 1e7 || rows > 1e7) return {};
  Lattice lattice{static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows), {}};
  lattice.node.resize(mesh.vertices());
  std::vector<bool> taken(static_cast<std::size_t>(columns * rows));
  constexpr double kOff = 1e-4;
  const double exact_x = x.size() / (columns - 1), exact_y = y.size() / (rows - 1);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const double column = (mesh.x[v] - x.low) / exact_x, row = (mesh.y[v] - y.low) / exact_y;
    const double c = std::round(column), r = std::round(row);
    if (std::abs(c - column) > kOff || std::abs(r - row) > kOff) return {};
    const auto node = static_cast<std::uint32_t>(r * columns + c);
    if (taken[node]) return {};
    taken[node] = true;
    lattice.node[v] = node;
  }
  return lattice;
}

/// Vertices by key, equal ones in their old order.
std::vector<std::uint32_t> sorted_by(const std::vector<std::uint32_t>& key, std::size_t keys) {
  std::vector<std::uint32_t> start(keys + 1), order(key.size());
  for (const std::uint32_t k : key) ++start[k + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  for (std::uint32_t v = 0; v < key.size(); ++v) order[start[key[v]]++] = v;
  return order;
}

void take_vertices(const HeightMesh& mesh, const std::vector<std::uint32_t>& order, const std::vector<Point>& at, Plan& plan,
                   bool clockwise) {
  const std::size_t count = mesh.vertices();
  std::vector<std::uint32_t> number(count);
  plan.at.resize(count);
  plan.z.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    number[order[i]] = i;
    plan.at[i] = at[order[i]];
    plan.z[i] = plan.scale.height(mesh.z[order[i]]);
  }
  plan.triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    plan.triangles.push_back({number[t[0]], number[t[clockwise ? 2 : 1]], number[t[clockwise ? 1 : 2]]});
  }
}

/// Nodes in square tiles: vertices that lie near each other are numbered near each other, for the sake of caches.
constexpr std::uint32_t kTile = 32;

std::uint32_t in_tiles(std::uint32_t column, std::uint32_t row, std::uint32_t columns) {
  const std::uint32_t tiles = (columns + kTile - 1) / kTile;
  return ((row / kTile * tiles + column / kTile) * kTile + row % kTile) * kTile + column % kTile;
}

void plan_lattice(const HeightMesh& mesh, const Lattice& lattice, Plan& plan, bool clockwise) {
  constexpr std::int32_t kStep = LatticeSamples::kStep;
  plan.columns = lattice.columns;
  plan.rows = lattice.rows;
  plan.units_per_cell = kStep;
  const auto columns = static_cast<std::uint32_t>(lattice.columns);
  const std::size_t nodes = std::size_t{columns} * static_cast<std::size_t>(lattice.rows);
  plan.lattice_z.assign(nodes, kNoSample);
  std::vector<Point> at(mesh.vertices());
  std::vector<std::uint32_t> key(mesh.vertices());
  std::uint32_t keys = 0;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const std::uint32_t node = lattice.node[v];
    key[v] = in_tiles(node % columns, node / columns, columns);
    keys = std::max(keys, key[v] + 1);
    at[v] = {static_cast<std::int32_t>(node % columns) * kStep, static_cast<std::int32_t>(node / columns) * kStep};
    plan.lattice_z[node] = plan.scale.height(mesh.z[v]);
  }
  const std::vector<std::uint32_t> order = sorted_by(key, keys);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key[order[i]] / (kTile * kTile) != key[order[i - 1]] / (kTile * kTile)) plan.block_start.push_back(i);
  }
  plan.block_start.push_back(static_cast<std::uint32_t>(order.size()));
  take_vertices(mesh, order, at, plan, clockwise);
}

/// From the edges of the input: those of triangles that are needles say nothing of how steep it is, edges do.
std::vector<std::uint8_t> steepest_edges(const Plan& plan) {
  std::vector<double> rise2(plan.at.size(), 0);
  for (const auto& t : plan.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const double dx = plan.at[b].x - plan.at[a].x, dy = plan.at[b].y - plan.at[a].y,
                   dz = static_cast<double>(plan.z[b]) - static_cast<double>(plan.z[a]);
      const double here = dz * dz / (dx * dx + dy * dy);
      rise2[a] = std::max(rise2[a], here), rise2[b] = std::max(rise2[b], here);
    }
  }
  std::vector<std::uint8_t> steep(rise2.size());
  for (std::size_t v = 0; v < steep.size(); ++v) {
    int octave = 0;  // of the rise, rounded up
    if (rise2[v] > 0) std::frexp(std::sqrt(rise2[v]), &octave);
    steep[v] = static_cast<std::uint8_t>(rise2[v] > 0 ? std::clamp(octave + kLevelClass, kLeastSteep, kMostSteep) : kLeastSteep);
  }
  return steep;
}

struct Bins {
  std::vector<std::uint32_t> of;     ///< indexed by vertex
  std::vector<std::uint32_t> start;  ///< Plan::bin_start
  /// Plan::bin_company
  double company() const {
    double pairs = 0;
    for (std::size_t bin = 1; bin < start.size(); ++bin) {
      const double count = start[bin] - start[bin - 1];
      pairs += count * count;
    }
    return pairs / static_cast<double>(of.size());
  }
};

/// plan: its bins' size and number.
Bins sorted_into_bins(const std::vector<Point>& at, const Plan& plan) {
  Bins bins;
  for (const Point& p : at)
    bins.of.push_back(static_cast<std::uint32_t>((p.y >> plan.bin_shift) * plan.bin_columns + (p.x >> plan.bin_shift)));
  bins.start.assign(static_cast<std::size_t>(plan.bin_columns) * static_cast<std::size_t>(plan.bin_rows) + 1, 0);
  for (const std::uint32_t bin : bins.of) ++bins.start[bin + 1];
  std::partial_sum(bins.start.begin(), bins.start.end(), bins.start.begin());
  return bins;
}

/// The longer side gets 2^26 units; bins are about one vertex large. Where vertices lie close together in parts of the plan they
/// are smaller, as far as there is memory for what lies between.
void plan_scattered(const HeightMesh& mesh, const MinMax& x, const MinMax& y, Plan& plan, bool clockwise) {
  constexpr double kUnits = 1 << 26;
  const double unit = std::max(x.size(), y.size()) / kUnits;
  plan.scale.unit_x = plan.scale.unit_y = unit;
  const double cell = std::sqrt(x.size() / unit * (y.size() / unit) / static_cast<double>(mesh.vertices()));
  plan.units_per_cell = static_cast<float>(std::max(16.0, cell));
  while (plan.bin_shift < 26 && (2 << plan.bin_shift) <= plan.units_per_cell * 1.5f) ++plan.bin_shift;
  std::vector<Point> at(mesh.vertices());
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    at[v] = {static_cast<std::int32_t>(std::round((mesh.x[v] - x.low) / unit)),
             static_cast<std::int32_t>(std::round((mesh.y[v] - y.low) / unit))};
  }
  const auto cut = [&] {
    plan.bin_columns = (static_cast<std::int32_t>(std::round(x.size() / unit)) >> plan.bin_shift) + 1;
    plan.bin_rows = (static_cast<std::int32_t>(std::round(y.size() / unit)) >> plan.bin_shift) + 1;
    return sorted_into_bins(at, plan);
  };
  constexpr double kCrowd = 32;
  const std::size_t most_bins = std::max(std::size_t{1} << 24, 4 * mesh.vertices());
  Bins bins = cut();
  plan.bin_company = bins.company();
  while (plan.bin_company > kCrowd && 4 * bins.start.size() <= most_bins && plan.bin_shift > 4) {
    --plan.bin_shift;
    bins = cut();
    plan.bin_company = bins.company();
  }
  plan.bin_start = std::move(bins.start);
  take_vertices(mesh, sorted_by(bins.of, plan.bin_start.size() - 1), at, plan, clockwise);
  plan.steep = steepest_edges(plan);
}

}  // namespace

void PlanScale::set_heights(double low, double high) {
  const double size = high - low;
  middle_z = low + size / 2;
  int exponent = 0;
  if (size > 0) std::frexp(size / 2, &exponent);
  scale_z = size > 0 ? std::ldexp(1.0, std::clamp(11 - exponent, -1000, 1000)) : 1;
}

Plan make_plan(const HeightMesh& mesh, bool clockwise) {
  const MinMax x = range_of(mesh.x), y = range_of(mesh.y), z = range_of(mesh.z);
  Plan plan;
  plan.scale.set_heights(z.low, z.high);
  plan.scale.x0 = x.low;
  plan.scale.y0 = y.low;
  const Lattice lattice = find_lattice(mesh, x, y);
  if (lattice.columns > 0) {
    plan.scale.unit_x = x.size() / ((lattice.columns - 1.0) * LatticeSamples::kStep);
    plan.scale.unit_y = y.size() / ((lattice.rows - 1.0) * LatticeSamples::kStep);
    plan_lattice(mesh, lattice, plan, clockwise);
  } else {
    plan_scattered(mesh, x, y, plan, clockwise);
  }
  return plan;
}

}  // namespace cordillera::gpu::fit
