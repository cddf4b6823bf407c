#include "pipeline/bound/loose.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "gpu/measure/surface_error_window.h"
#include "pipeline/bound/overlay.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

gpu::PlanTriangle plan_triangle(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  gpu::PlanTriangle plan;
  const auto [west, east] = std::minmax({mesh.x[t[0]], mesh.x[t[1]], mesh.x[t[2]]});
  const auto [south, north] = std::minmax({mesh.y[t[0]], mesh.y[t[1]], mesh.y[t[2]]});
  plan.columns = {west, east};
  plan.rows = {south, north};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t from = t[k], to = t[(k + 1) % 3];
    plan.edge[k] = {
        mesh.x[from], mesh.y[from], std::int64_t{mesh.x[to]} - mesh.x[from], std::int64_t{mesh.y[to]} - mesh.y[from], 0, false};
  }
  return plan;
}

bool is_unpublished(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t) { return !is_published(mesh, t); }

bool covers(const TileMesh& mesh, const TriangleIndex& published, const gpu::MeshPoint& p, std::vector<std::uint32_t>& near) {
  const PlanPoint at{static_cast<double>(p.x), static_cast<double>(p.y)};
  published.meeting({at, at, at}, near);
  return std::any_of(near.begin(), near.end(), [&](std::uint32_t k) {
    const auto& t = mesh.triangles[k];
    const gpu::MeshPoint c[3] = {
        {mesh.x[t[0]], mesh.y[t[0]], 0}, {mesh.x[t[1]], mesh.y[t[1]], 0}, {mesh.x[t[2]], mesh.y[t[2]], 0}};
    return gpu::twice_area(c[0], c[1], p) >= 0 && gpu::twice_area(c[1], c[2], p) >= 0 && gpu::twice_area(c[2], c[0], p) >= 0;
  });
}

double area_of(const Common& ground) {
  double twice = 0;
  for (int k = 2; k < ground.count; ++k) twice += twice_area(ground.corner[0], ground.corner[k - 1], ground.corner[k]);
  return twice / 2;
}

// The part of a mesh's rectangle without published triangles.
class Gaps {
 public:
  /// asked: holds the triangles that it will be asked of.
  Gaps(const TileMesh& mesh, const PlanBox& asked) : mesh_(mesh), index_(mesh, is_unpublished, asked) {}

  /// Of a triangle, in units squared. meets: whether there is any, however small.
  double area(const std::array<PlanPoint, 3>& triangle, bool& meets) {
    double area = 0;
    meets = false;
    index_.meeting(triangle, near_);
    for (const std::uint32_t k : near_) {
      const Common ground = common_part(triangle, plan_of(mesh_, mesh_.triangles[k]));
      if (ground.count <= 2) continue;
      meets = true;
      area += area_of(ground);
    }
    return area;
  }

 private:
  const TileMesh& mesh_;
  TriangleIndex index_;
  std::vector<std::uint32_t> near_;
};

// Appends triangles of other meshes, with the vertices that they need.
class Patches {
 public:
  explicit Patches(Loose& loose) : loose_(loose) {}

  void from(const TileMesh& mesh, std::int32_t east = 0, std::int32_t north = 0) {
    source_ = &mesh;
    east_ = east;
    north_ = north;
    number_.assign(mesh.vertices(), UINT32_MAX);
  }
  void add(const std::array<std::uint32_t, 3>& triangle, double error_m) {
    TileMesh& to = loose_.patches;
    std::array<std::uint32_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& number = number_[triangle[k]];
      if (number == UINT32_MAX) {
        number = static_cast<std::uint32_t>(to.vertices());
        to.x.push_back(source_->x[triangle[k]] + east_);
        to.y.push_back(source_->y[triangle[k]] + north_);
        to.height.push_back(source_->height[triangle[k]]);
        to.mark.push_back(0);
      }
      corners[k] = number;
    }
    to.triangles.push_back(corners);
    loose_.patch_error_m.push_back(error_m);
  }

 private:
  Loose& loose_;
  const TileMesh* source_ = nullptr;
  std::int32_t east_ = 0, north_ = 0;
  std::vector<std::uint32_t> number_;  // indexed by source vertex
};

bool may_hold_void(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return !is_published(mesh, t) || ((mesh.mark[t[0]] | mesh.mark[t[1]] | mesh.mark[t[2]]) & kOverVoid) != 0;
}

// Is there data at every place of a triangle, its sides included?
bool has_data_throughout(const gpu::PlanTriangle& plan, const gpu::SampleWindow& window) {
  if (plan.rows.first < window.rows().first || plan.rows.last > window.rows().last) return false;
  for (std::int64_t y = plan.rows.first; y <= plan.rows.last; ++y) {
    const gpu::Span span = plan.row(y).closed;
    std::uint64_t valid = 0;
    for (const auto& s : window.stretches()) {
      const gpu::Span here = gpu::intersection(span, s.columns);
      if (gpu::length(here) > 0) valid += gpu::count_valid(window.row(y) + here.first + s.shift, gpu::length(here));
    }
    if (valid < gpu::length(span)) return false;
  }
  return true;
}

void mark_corners(TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  for (const std::uint32_t v : t) mesh.mark[v] |= kOverVoid;
}

bool by_rows(const gpu::MeshPoint& a, const gpu::MeshPoint& b) { return std::tie(a.y, a.x) < std::tie(b.y, b.x); }

}  // namespace

std::vector<gpu::MeshPoint> uncovered_samples(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& mesh,
                                              const proto::Samples& samples) {
  if (!has_voids(mesh)) return {};
  gpu::SurfaceErrorInput input;
  input.lattice = &lattice;
  input.tile = tile;
  input.samples = &samples;
  const gpu::SampleWindow window(input, mesh.side);
  const auto across = static_cast<std::size_t>(samples.columns);
  std::vector<bool> covered(across * static_cast<std::size_t>(samples.rows));  // as the samples are, from the window's first row
  const auto place = [&](std::int64_t x, std::int64_t y, const gpu::SampleWindow::Stretch& s) {
    return static_cast<std::ptrdiff_t>(static_cast<std::size_t>(y - window.rows().first) * across +
                                       static_cast<std::size_t>(x + s.shift));
  };
  for (const auto& t : mesh.triangles) {
    if (!is_published(mesh, t)) continue;
    const gpu::PlanTriangle plan = plan_triangle(mesh, t);
    const gpu::Span rows = gpu::intersection(plan.rows, window.rows());
    for (std::int64_t y = rows.first; y <= rows.last; ++y)
      for (const auto& s : window.stretches()) {
        const gpu::Span span = gpu::intersection(plan.row(y).closed, s.columns);
        if (gpu::length(span) > 0)
          std::fill(covered.begin() + place(span.first, y, s), covered.begin() + place(span.last, y, s) + 1, true);
      }
  }
  std::vector<gpu::MeshPoint> found;
  for (std::int64_t y = window.rows().first; y <= window.rows().last; ++y)
    for (const auto& s : window.stretches())
      for (std::int64_t x = s.columns.first; x <= s.columns.last; ++x) {
        const std::int32_t height = window.row(y)[x + s.shift];
        if (height == proto::kNoHeight || covered[static_cast<std::size_t>(place(x, y, s))]) continue;
        found.push_back({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), height});
      }
  return found;
}

Loose joined(const std::array<const Loose*, 4>& children, std::int32_t child_side) {
  Loose all;
  all.patches.side = 2 * child_side;
  Patches patches(all);
  for (std::size_t c = 0; c < 4; ++c) {
    if (!children[c]) continue;
    const std::int32_t east = c & 1 ? child_side : 0, north = c & 2 ? child_side : 0;
    for (const gpu::MeshPoint& p : children[c]->samples) all.samples.push_back({p.x + east, p.y + north, p.height});
    patches.from(children[c]->patches, east, north);
    for (std::size_t k = 0; k < children[c]->patches.triangles.size(); ++k)
      patches.add(children[c]->patches.triangles[k], children[c]->patch_error_m[k]);
  }
  std::sort(all.samples.begin(), all.samples.end(), by_rows);
  const auto same = [](const gpu::MeshPoint& a, const gpu::MeshPoint& b) {
    return a.x == b.x && a.y == b.y;
  };  // of a border, twice
  all.samples.erase(std::unique(all.samples.begin(), all.samples.end(), same), all.samples.end());
  return all;
}

LeftOut left_out(const TileMesh& mesh, const TileMesh& finer, double finer_error_m, const Loose& of_finer) {
  LeftOut left;
  left.loose.patches.side = mesh.side;
  const TriangleIndex published(mesh, proto::is_published);
  std::vector<std::uint32_t> near;
  for (const gpu::MeshPoint& p : of_finer.samples)
    if (!covers(mesh, published, p, near)) left.loose.samples.push_back(p);
  PlanBox asked = box_around(finer, proto::is_published);
  asked.add(box_around(of_finer.patches, [](const TileMesh&, const std::array<std::uint32_t, 3>&) { return true; }));
  Gaps now(mesh, asked), before(finer, asked);
  Patches patches(left.loose);
  bool meets = false;
  patches.from(finer);
  for (const auto& t : finer.triangles) {
    if (!is_published(finer, t)) continue;
    left.more_units2 += now.area(plan_of(finer, t), meets);
    if (meets) patches.add(t, finer_error_m);
  }
  patches.from(of_finer.patches);
  for (std::size_t k = 0; k < of_finer.patches.triangles.size(); ++k) {
    const auto& t = of_finer.patches.triangles[k];
    const auto plan = plan_of(of_finer.patches, t);
    const double area = now.area(plan, meets);
    if (meets) patches.add(t, of_finer.patch_error_m[k]);
    left.more_units2 -= std::max(0.0, before.area(plan, meets) - area);
  }
  return left;
}

void mark_over_void(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::Samples& samples,
                    TileMesh& mesh) {
  gpu::SurfaceErrorInput input;
  input.lattice = &lattice;
  input.tile = tile;
  input.samples = &samples;
  const gpu::SampleWindow window(input, mesh.side);
  for (const auto& t : mesh.triangles)
    if (is_published(mesh, t) && !has_data_throughout(plan_triangle(mesh, t), window)) mark_corners(mesh, t);
}

void mark_over_void(const TileMesh& finer, TileMesh& mesh) {
  const TriangleIndex doubtful(finer, may_hold_void, box_around(mesh, proto::is_published));
  std::vector<std::uint32_t> near;
  for (const auto& t : mesh.triangles) {
    if (!is_published(mesh, t)) continue;
    const auto plan = plan_of(mesh, t);
    doubtful.meeting(plan, near);
    const auto shares_ground = [&](std::uint32_t k) {
      return area_of(common_part(plan, plan_of(finer, finer.triangles[k]))) > 0;
    };
    if (std::any_of(near.begin(), near.end(), shares_ground)) mark_corners(mesh, t);
  }
}

std::vector<std::uint32_t> marked_over_void(const std::array<const TileMesh*, 4>& children, const TileMesh& welded) {
  std::vector<std::pair<std::int32_t, std::int32_t>> places;
  for (std::size_t c = 0; c < 4; ++c) {
    if (!children[c]) continue;
    const std::int32_t side = children[c]->side, east = c & 1 ? side : 0, north = c & 2 ? side : 0;
    for (std::uint32_t v = 0; v < children[c]->vertices(); ++v)
      if (children[c]->mark[v] & kOverVoid) places.emplace_back(children[c]->x[v] + east, children[c]->y[v] + north);
  }
  std::sort(places.begin(), places.end());
  std::vector<std::uint32_t> marked;
  for (std::uint32_t v = 0; v < welded.vertices(); ++v)
    if (std::binary_search(places.begin(), places.end(), std::pair(welded.x[v], welded.y[v]))) marked.push_back(v);
  return marked;
}

}  // namespace cordillera::pipeline
