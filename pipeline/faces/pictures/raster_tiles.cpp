#include "pipeline/faces/pictures/raster_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/faces/batches.h"
#include "pipeline/faces/outline_fill.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Result<std::optional<Document>> nothing() { return std::optional<Document>(); }

std::string path_at(const RasterStyle& style, const Place& place) {
  Resource tiles;
  tiles.path = style.path;
  return path_of(tiles, place);
}

/// What a tile is kept under: each ramp is another picture.
std::string kept_name(std::string path, const Place& place) {
  return place.ramp.empty() ? path : path.append("?").append(place.ramp);
}

/// What can show something: the data's own extent, and where heights go down to the geoid beside it all that a TileJSON's bounds
/// touch, so that no tile ends in a wall beside the next one.
raster::Area shown_area(const raster::Area& extent, Beyond beyond) {
  return beyond == Beyond::faded ? raster::unwrapped(extent) : extent;
}

/// Whether heights that no mesh has can lie in a tile.
bool is_filled(const Terrain& terrain, const Place& place, Beyond beyond) {
  const auto outline = terrain.outline();
  return outline.ok() && (*outline)->reaches(place.z, place.x, place.y, beyond == Beyond::faded);
}

/// A tile that shows something; it is kept, so that whoever lists paths and then fetches them draws once.
proto::Result<std::optional<Document>> drawn(const Terrain& terrain, const Place& place, const RasterStyle& style) {
  return terrain.kept(kept_name(path_at(style, place), place), [&]() -> proto::Result<std::optional<Document>> {
    const auto grid = filled_grid(terrain, place, style.beyond);
    if (!grid) return grid.problem();
    if (!*grid || !(*grid)->data) return nothing();
    return std::optional(document(style.encode(style.pixels(terrain, **grid, place))));
  });
}

proto::Result<std::optional<Document>> empty_tile(const Terrain& terrain, const Place& place, const RasterStyle& style) {
  return terrain.kept(kept_name(std::string(style.path), place), [&]() -> proto::Result<std::optional<Document>> {
    PixelHeights grid;
    grid.side = kTilePixels + 2 * kMargin;
    grid.height_m.assign(grid.side * grid.side, std::numeric_limits<double>::quiet_NaN());
    return std::optional(document(style.encode(style.pixels(terrain, grid, place))));
  });
}

struct Walk {
  const Terrain& terrain;
  Beyond beyond;
  const std::function<void(const Place&)>& found;
  raster::Area extent;
  Zooms zooms;

  /// Whether any mesh, of the level that the tile is drawn from or below it, lies under a tile.
  bool meshes_under(const Place& p) const {
    const int level = level_of(terrain.manifest(), zooms, p.z, row_latitude_deg(extent, p.z, p.y));
    const double tiles_a_degree = std::ldexp(1, level) / 180;
    const double west = p.x * 360 / std::ldexp(1, p.z), east = (p.x + 1) * 360 / std::ldexp(1, p.z);
    const double north = pixel_latitude_deg(p.z, double{kTilePixels} * p.y) + 90;
    const double south = pixel_latitude_deg(p.z, double{kTilePixels} * (p.y + 1)) + 90;
    const auto index = [&](double deg) { return static_cast<std::int32_t>(deg * tiles_a_degree); };
    const std::int32_t last = std::min(index(east), proto::tiles_across(level) - 1);
    return !terrain.store().extents(level, index(west), index(south), last, index(north)).empty();
  }
  void visit(const Place& p) const {
    if (!touches(shown_area(extent, beyond), p.z, p.x, p.y) || (!meshes_under(p) && !is_filled(terrain, p, beyond))) return;
    if (zooms.holds(p.z)) found(p);
    if (p.z >= zooms.last) return;
    for (std::int32_t child = 0; child < 4; ++child) visit({0, p.z + 1, 2 * p.x + (child & 1), 2 * p.y + (child >> 1)});
  }
};

}  // namespace

proto::Result<std::optional<Document>> raster_tile(const Terrain& terrain, const Place& place, const RasterStyle& style) {
  const auto extent = extent_of(terrain.manifest());
  // Clients ask for all that a TileJSON's bounds touch.
  if (!extent || !touches(raster::unwrapped(*extent), place.z, place.x, place.y)) return nothing();
  if (!zooms_of(terrain.manifest(), *extent).holds(place.z)) return nothing();
  const bool beside = !touches(*extent, place.z, place.x, place.y);
  if (beside && !is_filled(terrain, place, style.beyond)) return empty_tile(terrain, place, style);
  auto tile = drawn(terrain, place, style);
  return !tile || *tile ? tile : empty_tile(terrain, place, style);
}

void each_shown_tile(const Terrain& terrain, Beyond beyond, const PathSink& sink,
                     const std::function<std::optional<std::string>(const Place&)>& path_of) {
  const auto extent = extent_of(terrain.manifest());
  if (!extent) return;
  struct Candidate {
    Place place;
    std::optional<std::string> path;
  };
  Batches<Candidate> candidates(
      sink.threads(), [&](Candidate& one) { one.path = path_of(one.place); },
      [&](Candidate& one) {
        if (one.path) sink(*one.path);
      });
  const std::function<void(const Place&)> add = [&](const Place& place) { candidates.add({place, {}}); };
  Walk{terrain, beyond, add, *extent, zooms_of(terrain.manifest(), *extent)}.visit({});
  candidates.finish();
}

void each_raster_tile(const Terrain& terrain, const RasterStyle& style, const PathSink& sink) {
  each_shown_tile(terrain, style.beyond, sink, [&](const Place& place) -> std::optional<std::string> {
    if (sink.named() == Named::expected) return path_at(style, place);
    const auto tile = drawn(terrain, place, style);
    if (tile && !*tile) return std::nullopt;
    return path_at(style, place);  // a problem is told to whoever fetches it
  });
}

}  // namespace cordillera::pipeline::faces
