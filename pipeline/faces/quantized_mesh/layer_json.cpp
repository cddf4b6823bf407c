#include "pipeline/faces/quantized_mesh/layer_json.h"

#include <algorithm>
#include <cmath>

#include "pipeline/encode/json.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_grid.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/levels_shown.h"
#include "pipeline/store/water_mask.h"
#include "pipeline/tileset/html_text.h"

namespace cordillera::pipeline::faces {
namespace {

/// First and last parent columns whose children exist in a row of parents.
using Runs = std::vector<std::array<std::int32_t, 2>>;

Runs runs_of(const MeshGrid& grid, int z, std::int32_t parent_row) {
  std::vector<std::int32_t> columns;
  for (const MeshGrid::Under& node : grid.under(z, {0, 2 * parent_row, grid.across(z) - 1, 2 * parent_row + 1})) {
    columns.push_back(node.x / 2);
  }
  std::sort(columns.begin(), columns.end());
  Runs out;
  for (const std::int32_t column : columns) {
    if (!out.empty() && column <= out.back()[1] + 1) {
      out.back()[1] = column;
    } else
      out.push_back({column, column});
  }
  return out;
}

Json available(const MeshGrid& grid) {
  Json levels = Json::array();
  for (int z = 0; z <= grid.finest(); ++z) {
    Json ranges = Json::array();
    for (const TileRange& r : quantized_ranges(grid, z)) {
      ranges.push_back({{"startX", r.start_x}, {"startY", r.start_y}, {"endX", r.end_x}, {"endY", r.end_y}});
    }
    levels.push_back(std::move(ranges));
  }
  return levels;
}

/// What a client cannot see in the tiles: what is beside the data, and what the format's own rounding adds to each level's error.
Json about(const MeshGrid& grid) {
  const Terrain& terrain = grid.terrain();
  const proto::Manifest& manifest = terrain.manifest();
  const bool geoid = terrain.undulation_m(0, 0).ok();
  Json levels = Json::array();
  for (int z = 0; z <= grid.finest(); ++z) {
    const QuantizedLevel level = grid.quantized(z);
    Json entry = {{"level", z}, {"height_step", level.step_m}, {"position_step_degrees", 360.0 / grid.across(z) / kMostQuanta}};
    if (const auto error_m = stated_error_m(manifest, grid.level(z))) entry["stated_max_error"] = *error_m;
    if (manifest.provisional()) entry["stated_max_error"] = nullptr;
    levels.push_back(std::move(entry));
  }
  return {{"height_datum", "WGS 84 ellipsoid"},
          {"beside_the_data",
           {{"height", geoid ? "sea level" : "the ellipsoid"}, {"geoid", geoid ? Json(terrain.geoid_name()) : Json(nullptr)}}},
          {"levels", std::move(levels)}};
}

}  // namespace

std::vector<TileRange> quantized_ranges(const MeshGrid& grid, int z) {
  if (z == 0) return {{0, 0, grid.across(0) - 1, 0}};
  std::vector<TileRange> out;
  const auto& bounds = grid.terrain().manifest().bounds();
  const std::int32_t last = grid.up(z - 1) - 1;
  std::int32_t first_row = 0, last_row = last;
  if (bounds.size() >= 4) {
    first_row = std::clamp(static_cast<std::int32_t>(std::floor(grid.rows_to(z - 1, bounds[1]))) - 1, 0, last);
    last_row = std::clamp(static_cast<std::int32_t>(std::floor(grid.rows_to(z - 1, bounds[3]))) + 1, 0, last);
  }
  Runs before;
  for (std::int32_t row = first_row; row <= last_row; ++row) {
    const Runs runs = runs_of(grid, z, row);
    if (!runs.empty() && runs == before) {
      for (std::size_t k = 0; k < runs.size(); ++k) out[out.size() - 1 - k].end_y += 2;
    } else {
      for (const auto& [from, to] : runs) out.push_back({2 * from, 2 * row, 2 * to + 1, 2 * row + 1});
    }
    before = runs;
  }
  return out;
}

void each_quantized_tile(const MeshGrid& grid, int z, const TileVisitor& visit) {
  for (const TileRange& range : quantized_ranges(grid, z)) {
    for (std::int32_t y = range.start_y; y <= range.end_y; ++y) {
      for (std::int32_t x = range.start_x; x <= range.end_x; ++x) visit({z, x, y});
    }
  }
}

void each_quantized_tile(const MeshGrid& grid, const TileVisitor& visit) {
  for (int z = 0; z <= grid.finest(); ++z) each_quantized_tile(grid, z, visit);
}

std::string layer_json(const MeshGrid& grid, const std::string& projection) {
  const proto::Manifest& manifest = grid.terrain().manifest();
  Json out;
  out["tilejson"] = "2.1.0";
  out["name"] = manifest.title().empty() ? manifest.name() : manifest.title();
  out["version"] = "1.0.0";
  out["format"] = "quantized-mesh-1.0";
  out["scheme"] = "tms";
  out["projection"] = projection;
  out["tiles"] = Json::array({"terrain/{z}/{x}/{y}.terrain"});
  out["extensions"] = Json::array({"octvertexnormals"});
  if (has_water(manifest.options())) out["extensions"].push_back("watermask");
  if (!manifest.attribution().empty()) out["attribution"] = html_text(manifest.attribution());
  out["minzoom"] = 0;
  out["maxzoom"] = grid.finest();
  if (manifest.bounds_size() >= 4) {
    const double end_deg = projection == "EPSG:3857" ? kMercatorEnd_deg : 90;
    const auto latitude = [&](int k) { return std::clamp(manifest.bounds(k), -end_deg, end_deg); };
    const bool wraps = manifest.bounds(0) > manifest.bounds(2);  // readers of TileJSON want west below east
    out["bounds"] = Json::array({wraps ? -180 : manifest.bounds(0), latitude(1), wraps ? 180 : manifest.bounds(2), latitude(3)});
  }
  out["available"] = available(grid);
  out["cordillera"] = about(grid);
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cordillera::pipeline::faces
