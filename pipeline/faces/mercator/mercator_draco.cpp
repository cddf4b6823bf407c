#include "pipeline/faces/mercator/mercator_draco.h"

#include <array>
#include <cmath>

#include "pipeline/encode/json.h"
#include "pipeline/faces/mercator/mercator_grid.h"
#include "pipeline/faces/quantized_mesh/layer_json.h"
#include "pipeline/faces/tilejson.h"
#include "pipeline/store/levels_shown.h"

namespace cordillera::pipeline::faces {
namespace {

// A 64th of a cell where the level is its own finest: half of that, times the slope, is what rounding costs a height.
constexpr std::int32_t kLeastSide = 1 << 14;

constexpr std::string_view kTiles = "web-mercator/tiles/{z}/{x}/{y}.drc", kDocument = "web-mercator.json";

proto::Result<std::optional<Document>> tile_json(const Terrain& terrain, const Place&) {
  const proto::Manifest& manifest = terrain.manifest();
  const auto extent = extent_of(manifest);
  if (!extent) return beyond_mercator();
  const Zooms zooms = mercator_draco_zooms(manifest);
  Json out = tilejson_head(manifest, *extent, zooms, kTiles);
  out["description"] = "Draco meshes of the tiles of WebMercatorQuad";
  out["format"] = "drc";
  out["tileMatrixSetId"] = kWebMercator;
  out["tileMatrixSetURI"] = "http://www.opengis.net/def/tilematrixset/OGC/1.0/WebMercatorQuad";
  out["heights"] = "metres above the WGS 84 ellipsoid";
  out["drc_formula"] = kMercatorDrcFormula;
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    Json entry = {{"zoom", zoom}, {"level", mercator_level(zoom)}};
    if (const auto error_m = stated_error_m(manifest, mercator_level(zoom))) entry["stated_max_error"] = *error_m;
    if (manifest.provisional()) entry["stated_max_error"] = nullptr;
    entry["position_step_degrees"] = 360 / std::ldexp(mercator_side(terrain, zoom, kLeastSide), zoom);
    out["zooms"].push_back(std::move(entry));
  }
  return std::optional(document(out.dump(1, ' ', false, Json::error_handler_t::replace)));
}

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place);

constexpr std::array<Resource, 2> kResources = {{
    {kDocument, Grid::none, "application/json", "TileJSON of the meshes in WebMercatorQuad", tile_json, Links::tile_templates},
    {kTiles, Grid::web_mercator, "application/octet-stream",
     "A tile as a Draco mesh of integers; the TileJSON's drc_formula makes degrees and metres of them", tile},
}};

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return terrain.kept(path_of(kResources[1], place), [&]() -> proto::Result<std::optional<Document>> {
    if (!mercator_draco_zooms(terrain.manifest()).holds(place.z)) return std::optional<Document>();
    const proto::TileAddress at{place.z, place.x, (std::int32_t{1} << place.z) - 1 - place.y};
    const MercatorMesh cut = mercator_mesh(terrain, at, MercatorNormals::none);
    LatticeMesh mesh = on_lattice(cut, at, MercatorRows::map, mercator_side(terrain, place.z, kLeastSide)).mesh;
    if (mesh.triangles.empty()) return std::optional<Document>();
    mesh.z = place.z;
    mesh.x = place.x;
    mesh.y = place.y;
    mesh.web_mercator = true;
    return std::optional(document(draco_encode(mesh)));
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  const Zooms zooms = mercator_draco_zooms(terrain.manifest());
  const MercatorGrid grid(terrain);
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    each_quantized_tile(grid, zoom, [&](const proto::TileAddress& at) {
      const Place place{0, zoom, at.x, grid.up(zoom) - 1 - at.y};
      const bool expected = sink.named() == Named::expected;
      const auto made = expected ? proto::Result<std::optional<Document>>(std::nullopt) : tile(terrain, place);
      if (expected || !made || *made) sink(path_of(kResources[1], place));  // a problem is told to whoever fetches it
    });
  }
  if (zooms.first <= zooms.last) sink(std::string(kDocument));
}

}  // namespace

Zooms mercator_draco_zooms(const proto::Manifest& manifest) {
  if (!extent_of(manifest)) return {0, -1};
  const auto coarsest = static_cast<int>(manifest.min_level());
  return {coarsest == 0 ? 0 : coarsest + 1, finest_mercator_zoom(manifest)};
}

const Face& mercator_draco() {
  static const Face kFace = {"drc-mercator", "any program with Draco that draws a map in Web Mercator", kDocument, kResources,
                             each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
