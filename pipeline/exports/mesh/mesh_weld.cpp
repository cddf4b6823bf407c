#include "pipeline/exports/mesh/mesh_weld.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cordillera::pipeline::exports {

using proto::Vec3;

MeshWelder::MeshWelder(const proto::Lattice& lattice, const MeshWindow& window, MeshFrame frame,
                       std::array<std::int64_t, 2> middle, ToMap to_map)
    : lattice_(lattice), window_(window), frame_(frame), to_map_(std::move(to_map)) {
  const auto row = proto::row_frame(lattice, middle[1]);
  const auto column = proto::column_frame(lattice, middle[0]);
  origin_m_ = proto::ecef(row, column, 0);
  up_ = proto::normal(row, column);
  east_ = {0 - column.sin_lon, column.cos_lon, 0};
  north_ = proto::cross(up_, east_);
}

std::size_t MeshWelder::Hash::operator()(const Key& key) const {
  std::uint64_t hash = 0;
  for (const std::int64_t part : {key.column, key.row, key.height}) {
    hash = (hash ^ static_cast<std::uint64_t>(part)) * 0x9E3779B97F4A7C15ULL;
    hash ^= hash >> 29;
  }
  return hash;
}

Vec3 MeshWelder::position(std::int64_t column, std::int64_t row, double height_m) const {
  if (frame_ == MeshFrame::geodetic || frame_ == MeshFrame::map)
    return {lattice_.longitude_deg(column), lattice_.latitude_deg(row), height_m};
  const Vec3 at = proto::ecef(proto::row_frame(lattice_, row), proto::column_frame(lattice_, column), height_m);
  if (frame_ == MeshFrame::ecef) return at;
  const Vec3 from = at - origin_m_;
  return {dot(from, east_), dot(from, north_), dot(from, up_)};
}

std::uint32_t MeshWelder::push(const Vec3& position) {
  mesh_.x.push_back(position.x);
  mesh_.y.push_back(position.y);
  mesh_.z.push_back(position.z);
  return static_cast<std::uint32_t>(mesh_.vertices() - 1);
}

std::uint32_t MeshWelder::vertex(const Key& at, double height_m, bool shared) {
  if (!shared) return push(position(at.column, at.row, height_m));
  Key key = at;
  if (frame_ != MeshFrame::geodetic) {
    const bool pole = at.row == 0 || at.row == lattice_.rows();
    key.column = pole ? 0 : (at.column % lattice_.columns() + lattice_.columns()) % lattice_.columns();
  }
  const auto [found, fresh] = sides_.try_emplace(key, 0);
  if (fresh) found->second = push(position(key.column, key.row, height_m));
  return found->second;
}

/// Of a cell of the level: sides of the box pass vertices that are nearer than that, and cuts come together. Where a side lies a
/// hair's breadth beside vertices, or an edge runs through a corner, there would be needles that no float has room for.
constexpr double kNearCells = 1.0 / 256;

/// In a box that is smaller than a cell, of the box.
double MeshWelder::nearness() const {
  constexpr double kOfBox = 1.0 / 64;
  const double cell = static_cast<double>(lattice_.cell_units(window_.level));
  return std::min(kNearCells * cell, kOfBox * std::min(window_.east - window_.west, window_.north - window_.south));
}

/// Which step along which side; none of what is on no side.
std::optional<MeshWelder::Key> MeshWelder::on_box(const PlanPoint& at) const {
  const double near = nearness();
  std::array<bool, 4> on{};
  for (int side = 0; side < 4; ++side) on[static_cast<std::size_t>(side)] = std::abs(inside_of(at, window_, side)) <= near;
  const bool across = on[0] || on[2], along = on[1] || on[3];
  constexpr std::int64_t kCorner = 4;
  if (across && along) return Key{kCorner, on[0] ? 0 : 1, on[1] ? 0 : 1};
  if (across) return Key{on[0] ? 0 : 2, std::llround((at.y - window_.south) / near), 0};
  if (along) return Key{on[1] ? 1 : 3, std::llround((at.x - window_.west) / near), 0};
  return std::nullopt;
}

std::uint32_t MeshWelder::cut(std::uint32_t from, std::uint32_t to, double share, const PlanPoint& at) {
  const auto [found, fresh] = on_box_.try_emplace(on_box(at).value(), 0);
  if (!fresh) return found->second;
  const auto between = [&](const std::vector<double>& axis) { return axis[from] + share * (axis[to] - axis[from]); };
  found->second = push({between(mesh_.x), between(mesh_.y), between(mesh_.z)});
  return found->second;
}

void MeshWelder::push_triangle(const std::array<std::uint32_t, 3>& t) {
  // At a pole an edge of the lattice has no length.
  if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh_.triangles.push_back(t);
}

bool MeshWelder::inside(const LatticeMesh& tile, std::int64_t west, std::int64_t south) const {
  if (!window_.clipped) return true;
  return static_cast<double>(west) >= window_.west && static_cast<double>(west + tile.side) <= window_.east &&
         static_cast<double>(south) >= window_.south && static_cast<double>(south + tile.side) <= window_.north;
}

void MeshWelder::add(const LatticeMesh& tile, std::int64_t x) {
  const std::int64_t west = x * tile.side, south = std::int64_t{tile.y} * tile.side;
  const auto on_a_side = [&](std::int32_t units) { return units == 0 || units == tile.side; };
  const std::size_t before = mesh_.vertices();
  std::vector<std::uint32_t> vertices;
  vertices.reserve(tile.points.size());
  for (const auto& [u, v, h] : tile.points) {
    vertices.push_back(vertex({west + u, south + v, h}, h * tile.height_step, on_a_side(u) || on_a_side(v)));
  }
  const auto fresh = [before](std::vector<double>& axis) { return std::span(axis).subspan(before); };
  if (to_map_) to_map_(fresh(mesh_.x), fresh(mesh_.y), fresh(mesh_.z));  // before edges are cut, which are straight on the map
  if (inside(tile, west, south)) {
    for (const Triangle& t : tile.triangles) push_triangle({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
    return;
  }
  std::vector<ClipCorner> corners;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto& [u, v, h] = tile.points[k];
    corners.push_back({vertices[k], {static_cast<double>(west + u), static_cast<double>(south + v)}});
    if (const auto on = on_box(corners.back().at)) on_box_.try_emplace(*on, vertices[k]);
  }
  const CutEdge cut_edge = [this](std::uint32_t from, std::uint32_t to, double share, const PlanPoint& at) {
    return cut(from, to, share, at);
  };
  for (const Triangle& t : tile.triangles) {
    const auto polygon = clipped({corners[t[0]], corners[t[1]], corners[t[2]]}, window_, nearness(), cut_edge);
    for (std::size_t k = 2; k < polygon.size(); ++k) push_triangle({polygon[0].vertex, polygon[k - 1].vertex, polygon[k].vertex});
  }
}

}  // namespace cordillera::pipeline::exports
