#include "pipeline/bound/overlay.h"

#include <algorithm>
#include <cmath>

namespace cordillera::pipeline {
namespace {

// Sutherland and Hodgman's step: what of the polygon is to the left of a -> b.
Common cut(const Common& polygon, PlanPoint a, PlanPoint b) {
  Common rest;
  for (int k = 0; k < polygon.count; ++k) {
    const PlanPoint p = polygon.corner[k], q = polygon.corner[k + 1 == polygon.count ? 0 : k + 1];
    const double at_p = twice_area(a, b, p), at_q = twice_area(a, b, q);
    if (at_p >= 0) rest.corner[rest.count++] = p;
    if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) {
      const double r = at_p / (at_p - at_q);
      rest.corner[rest.count++] = {p.x + r * (q.x - p.x), p.y + r * (q.y - p.y)};
    }
  }
  return rest;
}

/// Whether a side of a, if it is counter-clockwise, has all of b beyond it. Corners lie on the lattice, so that this is exact.
bool are_apart(const std::array<PlanPoint, 3>& a, const std::array<PlanPoint, 3>& b) {
  if (twice_area(a[0], a[1], a[2]) <= 0) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const PlanPoint from = a[k], to = a[(k + 1) % 3];
    if (twice_area(from, to, b[0]) < 0 && twice_area(from, to, b[1]) < 0 && twice_area(from, to, b[2]) < 0) return true;
  }
  return false;
}

PlanBox box_of(const std::array<PlanPoint, 3>& t) {
  return {std::min({t[0].x, t[1].x, t[2].x}), std::min({t[0].y, t[1].y, t[2].y}), std::max({t[0].x, t[1].x, t[2].x}),
          std::max({t[0].y, t[1].y, t[2].y})};
}

}  // namespace

Common common_part(const std::array<PlanPoint, 3>& a, const std::array<PlanPoint, 3>& b) {
  if (are_apart(a, b) || are_apart(b, a)) return {};
  Common part{3, {a[0], a[1], a[2]}};
  for (std::size_t k = 0; k < 3 && part.count > 0; ++k) part = cut(part, b[k], b[(k + 1) % 3]);
  return part;
}

std::array<PlanPoint, 3> plan_of(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  std::array<PlanPoint, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) corners[k] = {static_cast<double>(mesh.x[t[k]]), static_cast<double>(mesh.y[t[k]])};
  return corners;
}

void PlanBox::add(const PlanBox& o) {
  west = std::min(west, o.west), south = std::min(south, o.south);
  east = std::max(east, o.east), north = std::max(north, o.north);
}

PlanBox box_around(const proto::TileMesh& mesh, TriangleIndex::Wanted wanted) {
  PlanBox all;
  for (const auto& t : mesh.triangles)
    if (wanted(mesh, t)) all.add(box_of(plan_of(mesh, t)));
  return all;
}

TriangleIndex::TriangleIndex(const proto::TileMesh& mesh, Wanted wanted, const PlanBox& asked) {
  PlanBox extent;
  std::vector<std::uint32_t> kept;
  box_.resize(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!wanted(mesh, mesh.triangles[t])) continue;
    const PlanBox box = box_[t] = box_of(plan_of(mesh, mesh.triangles[t]));
    if (!box.meets(asked)) continue;
    extent.add({std::max(box.west, asked.west), std::max(box.south, asked.south), std::min(box.east, asked.east),
                std::min(box.north, asked.north)});
    kept.push_back(t);
  }
  if (kept.empty()) extent = {0, 0, 0, 0};
  west_ = extent.west, south_ = extent.south;
  across_ = std::max(1, static_cast<std::int32_t>(std::sqrt(static_cast<double>(kept.size()) / 2)));
  cells_per_unit_ = across_ / std::max({extent.east - west_, extent.north - south_, 1.0});
  start_.assign(static_cast<std::size_t>(across_) * across_ + 2, 0);
  const auto each = [&](auto&& visit) {
    constexpr std::int32_t kFew = 4;
    for (const std::uint32_t t : kept) {
      const auto plan = plan_of(mesh, mesh.triangles[t]);
      const Cells c = cells_of(box_[t]);
      const bool few = (c.x1 - c.x0 + 1) * (c.y1 - c.y0 + 1) <= kFew;
      for (std::int32_t y = c.y0; y <= c.y1; ++y)
        for (std::int32_t x = c.x0; x <= c.x1; ++x)
          if (few || touches(plan, x, y)) visit(static_cast<std::size_t>(y) * across_ + x, t);
    }
  };
  each([&](std::size_t cell, std::uint32_t) { ++start_[cell + 2]; });
  for (std::size_t cell = 2; cell < start_.size(); ++cell) start_[cell] += start_[cell - 1];
  triangle_.resize(start_.back());
  each([&](std::size_t cell, std::uint32_t t) { triangle_[start_[cell + 1]++] = t; });
}

/// Whether a triangle may touch a cell, which is taken for a little larger than it is.
bool TriangleIndex::touches(const std::array<PlanPoint, 3>& t, std::int32_t x, std::int32_t y) const {
  if (twice_area(t[0], t[1], t[2]) <= 0) return true;
  constexpr double kSlack = 1.0 / 64;
  const double cell = 1 / cells_per_unit_;
  const double west = west_ + (x - kSlack) * cell, east = west_ + (x + 1 + kSlack) * cell;
  const double south = south_ + (y - kSlack) * cell, north = south_ + (y + 1 + kSlack) * cell;
  for (std::size_t k = 0; k < 3; ++k) {
    const PlanPoint from = t[k], to = t[(k + 1) % 3];
    // The corner that lies farthest to the left of the side.
    const PlanPoint corner{to.y > from.y ? west : east, to.x > from.x ? north : south};
    if (twice_area(from, to, corner) < 0) return false;
  }
  return true;
}

TriangleIndex::Cells TriangleIndex::cells_of(const PlanBox& box) const {
  const auto cell = [&](double units) {
    return static_cast<std::int32_t>(std::clamp(units * cells_per_unit_, 0.0, across_ - 1.0));
  };
  return {cell(box.west - west_), cell(box.south - south_), cell(box.east - west_), cell(box.north - south_)};
}

void TriangleIndex::meeting(const std::array<PlanPoint, 3>& triangle, std::vector<std::uint32_t>& found) const {
  found.clear();
  const PlanBox box = box_of(triangle);
  const Cells c = cells_of(box);
  for (std::int32_t y = c.y0; y <= c.y1; ++y)
    for (std::int32_t x = c.x0; x <= c.x1; ++x) {
      const std::size_t cell = static_cast<std::size_t>(y) * across_ + x;
      for (std::uint32_t k = start_[cell]; k < start_[cell + 1]; ++k)
        if (box_[triangle_[k]].meets(box)) found.push_back(triangle_[k]);
    }
  if (c.x0 == c.x1 && c.y0 == c.y1) return;
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

}  // namespace cordillera::pipeline
