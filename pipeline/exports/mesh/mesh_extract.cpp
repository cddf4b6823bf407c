#include "pipeline/exports/mesh/mesh_extract.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "pipeline/encode/published_mesh.h"
#include "pipeline/exports/export_work.h"
#include "pipeline/exports/mesh/mesh_weld.h"
#include "pipeline/exports/whole_file.h"
#include "raster/place/area.h"
#include "raster/place/map_projection.h"

namespace cordillera::pipeline::exports {
namespace {

using proto::Problem;

raster::Area area_of_tile(const proto::TileAddress& tile) {
  const double side_deg = std::ldexp(180, -tile.z);
  return {tile.x * side_deg - 180, tile.y * side_deg - 90, (tile.x + 1) * side_deg - 180, (tile.y + 1) * side_deg - 90};
}

/// The lattice's vertex in the middle of what is asked for and lies within the dataset's bounds: who asks for the whole earth has
/// coordinates about the data, too.
std::array<std::int64_t, 2> middle_of(const faces::Terrain& terrain, const MeshRequest& request) {
  const raster::Area all = raster::area_of(terrain.manifest().bounds()).value_or(raster::Area{-180, -90, 180, 90});
  const raster::Area asked = request.tile ? area_of_tile(*request.tile) : request.box.value_or(all);
  const raster::Area area = raster::intersect(all, asked).value_or(asked);
  const double units_a_degree = static_cast<double>(terrain.lattice().rows()) / 180;
  return {std::llround(((area.west_deg + area.east_deg) / 2 + 180) * units_a_degree),
          std::llround(((area.south_deg + area.north_deg) / 2 + 90) * units_a_degree)};
}

/// Where fans touch in a vertex only, each gets one of its own.
proto::TriangleMesh split_fans(MeshWelder& welder) {
  proto::TriangleMesh& all = welder.mesh();
  proto::TileMesh plain;
  plain.mark.assign(all.vertices(), 0);
  plain.triangles = std::move(all.triangles);
  PublishedMesh split = published_mesh(plain);
  proto::TriangleMesh out;
  out.triangles = std::move(split.triangles);
  for (const auto axis : {&proto::TriangleMesh::x, &proto::TriangleMesh::y, &proto::TriangleMesh::z}) {
    (out.*axis).reserve(split.source.size());
    for (const std::uint32_t vertex : split.source) (out.*axis).push_back((all.*axis)[vertex]);
  }
  return out;
}

/// The map that is asked for. A geoid is there.
proto::Result<raster::MapProjection> map_of(const faces::Terrain& terrain, const MeshRequest& request) {
  const auto [column, row] = middle_of(terrain, request);
  const double longitude_deg = terrain.lattice().longitude_deg(column), latitude_deg = terrain.lattice().latitude_deg(row);
  if (const auto geoid = terrain.undulation_m(longitude_deg, latitude_deg); !geoid) return geoid.problem();
  const std::string& own = terrain.manifest().source().crs();
  const std::string code = request.map.empty() ? raster::code_in_label(own) : request.map;
  auto map = raster::MapProjection::open(code, longitude_deg, latitude_deg);
  if (!map && request.map.empty())
    return Problem{map.problem().type,
                   own.empty()    ? "the rasters have no CRS in common"
                   : code.empty() ? "the raster's own CRS, " + own + ", has no code"
                                  : "the raster's own CRS: " + map.problem().detail,
                   map.problem().accepted, "frame"};
  return map;
}

ToMap onto(const raster::MapProjection& map, const faces::Terrain& terrain) {
  return [&map, &terrain](std::span<double> x, std::span<double> y, std::span<double> height) {
    for (std::size_t k = 0; k < x.size(); ++k) height[k] = (height[k] - terrain.undulation_m(x[k], y[k]).value()) / map.unit_m();
    map.project(x.data(), y.data(), x.size());
  };
}

/// Seen from above each triangle is counter-clockwise. A map that ends within the mesh, or on which it lies on both sides of a
/// seam, has some that are not, or has no place for a vertex.
bool lies_flat(const proto::TriangleMesh& mesh) {
  constexpr double kRounded = 1e-9;  // of the square of a side
  return std::ranges::all_of(mesh.triangles, [&](const auto& t) {
    const double ax = mesh.x[t[1]] - mesh.x[t[0]], ay = mesh.y[t[1]] - mesh.y[t[0]], bx = mesh.x[t[2]] - mesh.x[t[0]],
                 by = mesh.y[t[2]] - mesh.y[t[0]];
    return ax * by - ay * bx >= -kRounded * (ax * ax + ay * ay + bx * bx + by * by);
  });
}

/// Nothing where the mesh would have more triangles than it may.
std::optional<ExtractedMesh> extract(const faces::Terrain& terrain, const MeshRequest& request, int level, const ToMap& to_map,
                                     ExportProgress& progress) {
  const MeshWindow window = window_of(terrain, request, level);
  const auto [column, row] = middle_of(terrain, request);
  MeshWelder welder(terrain.lattice(), window, request.frame, {column, row}, to_map);
  bool whole = true;
  progress.expect(terrain, [&](const auto& one) {
    each_tile(terrain, window, [&](const proto::TileRecord&, std::int64_t) { return one(), true; });
  });
  each_tile(terrain, window, [&](const proto::TileRecord& record, std::int64_t x) {
    const auto tile = terrain.mesh({level, static_cast<std::int32_t>(record.x()), static_cast<std::int32_t>(record.y())});
    if (tile) welder.add(tile->mesh(), x);
    progress.next();
    whole = welder.mesh().triangles.size() <= request.most_triangles;
    return whole && !terrain.is_stopped();
  });
  if (!whole) return std::nullopt;
  const proto::Lattice lattice = terrain.lattice();
  ExtractedMesh out{split_fans(welder), level, request.frame, lattice.longitude_deg(column), lattice.latitude_deg(row),
                    welder.origin_m(),  {}};
  if (out.longitude_deg > 180) out.longitude_deg -= 360;
  return out;
}

std::string range_of(const proto::Manifest& manifest) {
  return "levels " + std::to_string(manifest.min_level()) + " to " + std::to_string(manifest.max_level());
}

/// The finest level below `from` that seems to fit; none does where even the coarsest has too many.
std::optional<int> level_that_fits(const faces::Terrain& terrain, const MeshRequest& request, int from) {
  for (int level = from; level >= static_cast<int>(terrain.manifest().min_level()); --level) {
    if (triangles_in(terrain, window_of(terrain, request, level), request.most_triangles) <=
        static_cast<double>(request.most_triangles))
      return level;
  }
  return std::nullopt;
}

Problem too_large(const faces::Terrain& terrain, const MeshRequest& request, int level) {
  const auto fits = request.tile ? std::nullopt : level_that_fits(terrain, request, level - 1);
  const std::string limit = std::to_string(request.most_triangles);
  return {"mesh-too-large", "level " + std::to_string(level) + " has more than " + limit + " triangles there",
          (fits ? "level " + std::to_string(*fits) + " or a coarser one, or a smaller bbox" : "a smaller bbox") +
              ", of at most " + limit + " triangles",
          fits ? "level" : "bbox"};
}

/// "2, 3, 4", from the coarsest.
std::string levels_with_triangles(const proto::Manifest& manifest) {
  std::string levels;
  for (auto level = manifest.levels().rbegin(); level != manifest.levels().rend(); ++level) {
    if (level->triangles() > 0) levels.append(levels.empty() ? "" : ", ").append(std::to_string(level->level()));
  }
  return levels;
}

Problem nothing_there(const faces::Terrain& terrain, const MeshRequest& request, int level) {
  const auto& manifest = terrain.manifest();
  if (request.tile) {
    const auto& [z, x, y] = *request.tile;
    return {"tile-unknown", "there is no tile " + std::to_string(z) + "/" + std::to_string(x) + "/" + std::to_string(y),
            range_of(manifest) + " within the dataset's bounds (y counts from the south)", "tile"};
  }
  const std::string others = request.box ? "" : levels_with_triangles(manifest);
  if (!others.empty())
    return {"option-invalid", "level " + std::to_string(level) + " of the dataset has no triangle",
            "a level that has some: " + others, "level"};
  const auto all = raster::area_of(manifest.bounds());
  const bool beside = all && request.box && !raster::intersect(*all, *request.box);
  return {"bbox-outside-raster",
          (beside ? "the bbox does not touch the dataset" : "level " + std::to_string(level) + " has no triangle in the bbox") +
              (beside ? raster::hint_on_order(*request.box, *all) : ""),
          "a box that touches the dataset: " + (all ? raster::text_of(*all) : ""), "bbox"};
}

}  // namespace

proto::Result<ExtractedMesh> extract_mesh(const faces::Terrain& terrain, const MeshRequest& request,
                                          const ProgressCallback& progress) {
  const auto least = static_cast<int>(terrain.manifest().min_level()), most = static_cast<int>(terrain.manifest().max_level());
  const auto wanted = request.tile ? std::optional(request.tile->z) : request.level;
  if (wanted && !request.tile && (*wanted < least || *wanted > most)) {
    return Problem{"option-invalid", "the dataset has no level " + std::to_string(*wanted), range_of(terrain.manifest()),
                   "level"};
  }
  if (request.tile && (*wanted < least || *wanted > most)) return nothing_there(terrain, request, *wanted);
  const auto first = wanted ? wanted : level_that_fits(terrain, request, most);
  if (!first) return too_large(terrain, request, least);
  std::optional<raster::MapProjection> map;
  ToMap to_map;
  if (request.frame == MeshFrame::map) {
    auto opened = map_of(terrain, request);
    if (!opened) return opened.problem();
    map.emplace(std::move(*opened));
    to_map = onto(*map, terrain);
  }
  ExportProgress told(progress);
  int level = *first;
  for (; level >= least; --level) {  // what seemed to fit may not
    auto mesh = extract(terrain, request, level, to_map, told);
    if (terrain.is_stopped()) return kStopped;
    if (mesh && mesh->mesh.triangles.empty()) return nothing_there(terrain, request, level);
    if (mesh && map) {
      mesh->map = {map->code(), map->label(), map->unit(), terrain.geoid_name()};
      if (!lies_flat(mesh->mesh))
        return Problem{"crs-unsupported",
                       map->label() + " does not hold all of the mesh: triangles are torn or turned over there",
                       "a CRS that holds it, or a smaller bbox", "frame"};
    }
    if (mesh) return std::move(*mesh);
    if (wanted) break;
  }
  return too_large(terrain, request, std::max(level, least));
}

}  // namespace cordillera::pipeline::exports
