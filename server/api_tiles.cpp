// What a published dataset serves: its manifest and its faces.
#include <algorithm>
#include <cmath>

#include "pipeline/manifest_json.h"
#include "server/api.h"
#include "server/digest.h"
#include "server/json.h"

namespace cordillera::server {
namespace {

/// Addresses may be rebuilt under the same URL, so a client always asks; what has not changed costs it a 304.
constexpr const char* kCacheControl = "public, no-cache";

Response answer(pipeline::faces::Document document, std::string_view type) {
  Response response;
  response.set("Content-Type", std::string(type));
  response.set("Cache-Control", kCacheControl);
  response.set("ETag", server::quoted(document.etag));
  response.body = std::move(document.bytes);
  return response;
}

/// Columns and rows of a level that the dataset's bounds touch, as text.
std::string range_text(const proto::Manifest& manifest, int level) {
  if (manifest.bounds_size() < 4) return "";
  const double per_deg = proto::tiles_up(level) / 180.0;
  const auto first = [per_deg](double deg, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::floor(deg * per_deg)), 0, count - 1);
  };
  const auto last = [per_deg](double deg, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::ceil(deg * per_deg)) - 1, 0, count - 1);
  };
  const auto across = proto::tiles_across(level), up = proto::tiles_up(level);
  const auto span = [](std::int32_t from, std::int32_t to) { return std::to_string(from) + ".." + std::to_string(to); };
  return "; at level " + std::to_string(level) + " x " +
         span(first(manifest.bounds(0) + 180, across), last(manifest.bounds(2) + 180, across)) + ", y " +
         span(first(manifest.bounds(1) + 90, up), last(manifest.bounds(3) + 90, up));
}

Response no_tile(const proto::Manifest& manifest, const pipeline::faces::Found& found) {
  const auto& [root, z, x, y] = found.place;
  const auto least = static_cast<int>(manifest.min_level()), most = static_cast<int>(manifest.max_level());
  const bool inside = z >= least && z <= most;
  std::string accepted = "levels " + std::to_string(least) + " to " + std::to_string(most) + " within the dataset's bounds";
  for (int i = 0; i < 4 && manifest.bounds_size() >= 4; ++i) accepted += (i == 0 ? " " : ", ") + Json(manifest.bounds(i)).dump();
  if (found.resource->grid == pipeline::faces::Grid::geodetic) accepted += range_text(manifest, inside ? z : most);
  accepted += found.resource->grid == pipeline::faces::Grid::web_mercator ? " (y counts from the north)" : " (y counts from the south)";
  accepted += "; a tile without data does not exist";
  const std::string where = (root == 0 ? "" : " below the root " + std::string(1, root)) + " at level " + std::to_string(z);
  return problem_response({"tile-unknown", "there is no tile" + where + ", x " + std::to_string(x) + ", y " + std::to_string(y), accepted, ""});
}

Response face(const pipeline::faces::Terrain& terrain, const pipeline::faces::Found& found) {
  if (!pipeline::faces::inside(found.resource->grid, found.place)) return no_tile(terrain.manifest(), found);
  auto made = found.resource->make(terrain, found.place);
  if (!made) return problem_response(made.problem());
  if (!*made) return no_tile(terrain.manifest(), found);
  return answer(std::move(**made), found.resource->type);
}

}  // namespace

Response published(Service& service, const Dataset& dataset, const Route& route) {
  if (dataset.state == State::failed) {
    const std::string why = dataset.problem ? dataset.problem->detail : "its build failed";
    return problem_response({"dataset-failed", "dataset " + dataset.id + " has nothing to fetch: " + why,
                             "posting a raster that can be built", ""});
  }
  if (dataset.state != State::ready) {
    auto response = problem_response({"dataset-not-ready", "dataset " + dataset.id + " is " + to_string(dataset.state),
                                      "asking again when GET /v1/datasets/" + dataset.id + " says ready", ""});
    response.set("Retry-After", "2");
    return response;
  }
  const auto terrain = service.library().open(dataset.id);
  if (!terrain) return problem_response(terrain.problem());
  if (route.resource == Resource::face) return face(**terrain, route.found);
  return answer(pipeline::faces::document(pipeline::manifest_json((*terrain)->manifest())), "application/json");
}

}  // namespace cordillera::server
