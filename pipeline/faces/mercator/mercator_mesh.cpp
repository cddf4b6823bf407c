#include "pipeline/faces/mercator/mercator_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "pipeline/faces/mesh_normals.h"
#include "pipeline/faces/mesh_pixels.h"
#include "pipeline/faces/web_mercator.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

/// A vertex of the dataset, wherever it is asked from.
struct SourceVertex {
  std::int64_t column = 0, row = 0;
  std::int32_t height = 0;
  friend auto operator<=>(const SourceVertex&, const SourceVertex&) = default;
};

class MercatorCutter {
 public:
  MercatorCutter(const Terrain& terrain, const proto::TileAddress& tile, MercatorNormals normals)
      : terrain_(terrain), lattice_(terrain.lattice()), wanted_(normals) {
    const double rows = static_cast<double>(lattice_.rows());
    out_.south = (mercator_latitude_deg(tile.z, tile.y) + 90) / 180 * rows;
    out_.north = (mercator_latitude_deg(tile.z, tile.y + 1) + 90) / 180 * rows;
    const int level = mercator_level(tile.z);
    const std::int64_t units = lattice_.tile_units(level);
    const std::int32_t first = tile.z == 0 ? 0 : tile.x, last = tile.z == 0 ? 1 : tile.x;
    west_ = first * units;
    out_.columns = static_cast<double>((last - first + 1) * units);
    const auto low = static_cast<std::int32_t>(out_.south / static_cast<double>(units));
    const auto high = std::min(static_cast<std::int32_t>(out_.north / static_cast<double>(units)), proto::tiles_up(level) - 1);
    for (std::int32_t y = low; y <= high; ++y) {
      for (std::int32_t x = first; x <= last; ++x) add({level, x, y});
    }
  }

  MercatorMesh mesh() { return std::move(out_); }

 private:
  void add(const proto::TileAddress& tile) {
    const auto index = terrain_.mesh(tile);
    if (!index) return;
    const LatticeMesh& mesh = index->mesh();
    const std::vector<Vec3> normals =
        wanted_ == MercatorNormals::all ? mesh_normals(terrain_, *index) : std::vector<Vec3>(mesh.points.size());
    const std::int64_t west = lattice_.west(tile), south = lattice_.south(tile);
    corners_.clear();
    numbers_.assign(mesh.points.size(), kNone);
    for (const auto& p : mesh.points) corners_.push_back({west + p[0], south + p[1], p[2]});
    mesh_ = &mesh;
    normals_ = &normals;
    for (const Triangle& t : mesh.triangles) add_triangle(t);
  }

  /// A triangle's part between two parallels has its corners there and the points where its edges cross them, in the order of a
  /// walk around it.
  void add_triangle(const Triangle& t) {
    std::array<std::uint32_t, 7> part{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const double from = static_cast<double>(corners_[a].row), to = static_cast<double>(corners_[b].row);
      if (from >= out_.south && from <= out_.north) part[count++] = vertex(a);
      const bool upward = from < to;
      for (const double row : {upward ? out_.south : out_.north, upward ? out_.north : out_.south}) {
        if ((from < row && row < to) || (to < row && row < from)) part[count++] = cut(a, b, row);
      }
    }
    for (std::size_t k = 2; k < count; ++k) out_.triangles.push_back({part[0], part[k - 1], part[k]});
  }

  std::uint32_t add_vertex(const MercatorMesh::Vertex& vertex) {
    out_.vertices.push_back(vertex);
    return static_cast<std::uint32_t>(out_.vertices.size() - 1);
  }

  /// Tiles that meet have equal vertices on their common side: there they are one.
  std::uint32_t vertex(std::uint32_t v) {
    if (numbers_[v] != kNone) return numbers_[v];
    const auto& p = mesh_->points[v];
    const SourceVertex& c = corners_[v];
    const bool side = p[0] == 0 || p[0] == mesh_->side || p[1] == 0 || p[1] == mesh_->side;
    const auto make = [&] {
      return add_vertex({static_cast<double>(c.column - west_), static_cast<double>(c.row), c.height, (*normals_)[v]});
    };
    if (!side) return numbers_[v] = make();
    const auto [found, fresh] = sides_.try_emplace(c);
    if (fresh) found->second = make();
    return numbers_[v] = found->second;
  }

  /// The same bits from either end of the edge and from either tile.
  std::uint32_t cut(std::uint32_t a, std::uint32_t b, double row) {
    if (corners_[b] < corners_[a]) std::swap(a, b);
    const SourceVertex &from = corners_[a], &to = corners_[b];
    const auto [found, fresh] = cuts_.try_emplace({from, to, row});
    if (!fresh) return found->second;
    const auto [share, column, height_m] = crossing(from, to, row);
    Vec3 normal = (*normals_)[a] + share * ((*normals_)[b] - (*normals_)[a]);
    if (wanted_ == MercatorNormals::all) normal = (1 / length(normal)) * normal;
    const double west = static_cast<double>(west_);
    found->second =
        add_vertex({column - west, row, static_cast<std::int32_t>(std::lround(height_m / proto::kHeightStep_m)), normal});
    return found->second;
  }

  struct Crossing {
    double share = 0, column = 0, height_m = 0;
  };
  /// from is the western end. Where the edge, which is straight in space, crosses the parallel: what is cut off lies on the very
  /// triangle.
  Crossing crossing(const SourceVertex& from, const SourceVertex& to, double row) const {
    const auto position = [&](const SourceVertex& c) {
      return proto::ecef(proto::row_frame(lattice_, c.row), proto::column_frame(lattice_, c.column),
                         c.height * proto::kHeightStep_m);
    };
    const proto::RowFrame parallel = row_frame_at(row * lattice_.cell_deg() - 90);
    const Vec3 start = position(from), along = position(to) - start;
    const auto out_m = [&](double share) {
      return std::hypot(start.x + share * along.x, start.y + share * along.y) - parallel.radius_m;
    };
    const auto up_m = [&](double share) { return start.z + share * along.z - parallel.axis_m; };
    // North of the normals that stand on the parallel, metres.
    const auto north_m = [&](double share) { return up_m(share) * parallel.cos_lat - out_m(share) * parallel.sin_lat; };
    const double share = zero_between(north_m);
    const Vec3 at = start + share * along;
    double column = static_cast<double>(from.column);
    if (to.column != from.column) {
      column = (std::atan2(at.y, at.x) * 180 / std::numbers::pi + 180) / lattice_.cell_deg();
      if (to.column == lattice_.columns() && column < static_cast<double>(from.column))
        column += static_cast<double>(lattice_.columns());
      column = std::clamp(column, static_cast<double>(from.column), static_cast<double>(to.column));
    }
    return {share, column, out_m(share) * parallel.cos_lat + up_m(share) * parallel.sin_lat};
  }

  /// M. Dowell and P. Jarratt, "A modified regula falsi method for computing the root of an equation", 1971. The function's signs
  /// differ at 0 and 1 unless a corner lies on the parallel but for the last bits.
  template <class Function>
  static double zero_between(const Function& f) {
    constexpr double kNear_m = 1e-7;
    double low = 0, high = 1, at_low = f(0), at_high = f(1);
    if (at_low * at_high >= 0) return std::abs(at_low) < std::abs(at_high) ? 0 : 1;
    double at = 0;
    for (int n = 0; n < 60; ++n) {
      at = high - at_high * (high - low) / (at_high - at_low);
      const double here = f(at);
      if (std::abs(here) < kNear_m) break;
      if (here * at_high < 0) {
        low = high;
        at_low = at_high;
      } else {
        at_low /= 2;
      }
      high = at;
      at_high = here;
    }
    return at;
  }

  static constexpr std::uint32_t kNone = ~0u;
  const Terrain& terrain_;
  const proto::Lattice lattice_;
  const MercatorNormals wanted_;
  std::int64_t west_ = 0;
  MercatorMesh out_;
  std::map<SourceVertex, std::uint32_t> sides_;
  std::map<std::tuple<SourceVertex, SourceVertex, double>, std::uint32_t> cuts_;
  // Of the tile that is being added, indexed by its vertices.
  const LatticeMesh* mesh_ = nullptr;
  const std::vector<Vec3>* normals_ = nullptr;
  std::vector<SourceVertex> corners_;
  std::vector<std::uint32_t> numbers_;
};

/// Nearest whole number; only what is on an end becomes one.
std::int32_t inside(double units, double low, double at, double high, std::int32_t side) {
  if (at <= low) return 0;
  if (at >= high) return side;
  return std::clamp(static_cast<std::int32_t>(std::lround(units)), 1, side - 1);
}

}  // namespace

double mercator_latitude_deg(int zoom, std::int32_t y) {
  return pixel_latitude_deg(zoom, double{kTilePixels} * (std::ldexp(1, zoom) - y));
}

MercatorMesh mercator_mesh(const Terrain& terrain, const proto::TileAddress& tile, MercatorNormals normals) {
  return MercatorCutter(terrain, tile, normals).mesh();
}

std::int32_t mercator_side(const Terrain& terrain, int zoom, std::int32_t least) {
  const std::int64_t cells = terrain.lattice().tile_units(mercator_level(zoom)) * (zoom == 0 ? 2 : 1);
  return static_cast<std::int32_t>(std::max<std::int64_t>(least, cells));
}

MercatorLattice on_lattice(const MercatorMesh& mesh, const proto::TileAddress& tile, MercatorRows rows, std::int32_t side) {
  MercatorLattice out;
  out.mesh.side = side;
  out.mesh.height_step = proto::kHeightStep_m;
  std::vector<std::uint32_t> number;
  std::map<std::array<std::int32_t, 2>, std::uint32_t> on_parallels;
  const double rows_a_degree = mesh.columns * std::ldexp(1, tile.z) / 360;
  for (std::uint32_t k = 0; k < mesh.vertices.size(); ++k) {
    const auto& vertex = mesh.vertices[k];
    const double up = rows == MercatorRows::latitude ? (vertex.row - mesh.south) / (mesh.north - mesh.south)
                                                     : std::ldexp(1, tile.z) - tile.y -
                                                           latitude_pixel(tile.z, vertex.row / rows_a_degree - 90) / kTilePixels;
    const std::int32_t u = inside(vertex.column / mesh.columns * side, 0, vertex.column, mesh.columns, side);
    const std::int32_t v = inside(up * side, mesh.south, vertex.row, mesh.north, side);
    auto here = static_cast<std::uint32_t>(out.mesh.points.size());
    if (v == 0 || v == side) {  // points of a cut that fall together: the lowest, seen from either tile
      const auto [found, fresh] = on_parallels.try_emplace({u, v}, here);
      here = found->second;
      if (!fresh) out.mesh.points[here][2] = std::min(out.mesh.points[here][2], vertex.height);
    }
    if (here == out.mesh.points.size()) {
      out.mesh.points.push_back({u, v, vertex.height});
      out.source.push_back(k);
    }
    number.push_back(here);
  }
  for (const Triangle& t : mesh.triangles) {
    const Triangle n{number[t[0]], number[t[1]], number[t[2]]};
    if (n[0] != n[1] && n[1] != n[2] && n[2] != n[0]) out.mesh.triangles.push_back(n);
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
