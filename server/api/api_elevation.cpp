// …/elevation: heights at places and along lines, from the meshes that clients get.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "pipeline/store/levels_shown.h"
#include "server/api/api.h"
#include "server/api/requests/elevation_query.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

double to_millimetres(double metres) { return std::round(metres * 1e3) / 1e3; }

proto::TileAddress tile_at(const raster::LinePoint& place, int level) {
  const double tiles_a_degree = std::ldexp(1, level) / 180;
  const auto among = [](double at, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::floor(at)), 0, count - 1);
  };
  return {level, among((place.longitude_deg + 180) * tiles_a_degree, proto::tiles_across(level)),
          among((place.latitude_deg + 90) * tiles_a_degree, proto::tiles_up(level))};
}

/// Places of one tile together: a mesh is decoded once, however the places are strewn.
std::vector<std::size_t> by_tile(const std::vector<raster::LinePoint>& places, int level) {
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tile_at(places[a], level) < tile_at(places[b], level); });
  return order;
}

Json place_json(const pipeline::faces::Terrain& terrain, const raster::LinePoint& place, int level, bool line) {
  Json json = {{"lon", place.longitude_deg}, {"lat", place.latitude_deg}};
  if (line) json["distance"] = to_millimetres(place.distance_m);
  const auto height_m = terrain.height_m(level, place.longitude_deg, place.latitude_deg);
  const auto undulation_m = height_m ? terrain.undulation_m(place.longitude_deg, place.latitude_deg) : proto::Problem{};
  json["ellipsoidal_height"] = height_m ? Json(to_millimetres(*height_m)) : Json();
  json["orthometric_height"] = undulation_m.ok() ? Json(to_millimetres(*height_m - *undulation_m)) : Json();
  return json;
}

/// The blocks that the places are in, each once; where nobody knows yet how large these are, tiles that lie in one each.
std::vector<proto::TileAddress> tiles_at(const std::vector<raster::LinePoint>& places, const proto::Manifest& shown) {
  const int level = shown.has_done_blocks() ? static_cast<int>(shown.done_blocks().level()) : proto::kMaxLevel;
  std::vector<proto::TileAddress> tiles;
  for (const raster::LinePoint& place : places) tiles.push_back(tile_at(place, level));
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

/// Blocks there are made next. Gives those that are still to come.
std::vector<proto::TileAddress> look_at_places(JobQueue& queue, const Dataset& dataset, const proto::Manifest& shown,
                                               const std::vector<raster::LinePoint>& places, JobQueue::Who who) {
  std::vector<proto::TileAddress> tiles = tiles_at(places, shown);
  std::erase_if(tiles, [&](const proto::TileAddress& tile) { return !is_to_come(dataset, &shown, tile); });
  const auto end = tiles.begin() + static_cast<std::ptrdiff_t>(std::min(tiles.size(), kMostLooks));
  queue.look(dataset, {tiles.begin(), end}, shown, who);
  return tiles;
}

}  // namespace

Response elevation(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  Opened opened = open_readable(service, dataset, route);
  if (!opened.terrain) return std::move(opened.refusal);
  const pipeline::faces::Terrain& terrain = *opened.terrain;
  const proto::Manifest& manifest = terrain.manifest();
  const auto query = elevation_query(request, static_cast<int>(manifest.min_level()), static_cast<int>(manifest.max_level()));
  if (!query) return problem_response(query.problem());
  // While a body came, the dataset may have become private, or gone.
  if (const Row now = service.find(dataset.id); !now || !may_see(request, *now))
    return problem_response(unknown_to(request, dataset.id));
  const bool sharpens = manifest.provisional() && route.version.empty();
  if (sharpens) {
    const MayWait wait = may_wait(service.settings().serve.limits, request);
    auto to_come = look_at_places(service.queue(), dataset, manifest, query->places,
                                  wait.preferred ? JobQueue::Who::waits : JobQueue::Who::passes);
    const bool waits = wait.preferred && !to_come.empty();
    if (auto later = waits ? wait_for(service, request, dataset, wait, all_of(std::move(to_come))) : std::nullopt)
      return std::move(*later);
  }
  const int level = query->level.value_or(static_cast<int>(manifest.max_level()));
  std::vector<Json> points(query->places.size());
  for (const std::size_t k : by_tile(query->places, level)) points[k] = place_json(terrain, query->places[k], level, query->line);
  const std::string& geoid = terrain.geoid_name();
  const auto error_m = pipeline::stated_error_m(manifest, level);
  Json json = {{"level", level}, {"stated_max_error", error_m ? Json(*error_m) : Json()}};
  if (manifest.provisional()) json["provisional"] = true;
  json["ellipsoid"] = "WGS 84";
  json["geoid"] = geoid.empty() ? Json() : Json(geoid);  // null where no grid is installed; orthometric heights are null then
  if (!manifest.attribution().empty()) json["attribution"] = manifest.attribution();
  if (query->line) json["length"] = to_millimetres(query->places.back().distance_m);
  json["points"] = std::move(points);
  Response response = json_response(200, json);
  response.set("Cache-Control", request.method == "POST" ? "no-store" : cache_control(route));
  if (request.method != "POST") response.set("ETag", quoted(pipeline::faces::document(response.body).etag));
  if (manifest.provisional()) mark_provisional(response);
  return response;
}

}  // namespace cordillera::server
