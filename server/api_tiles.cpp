// What a published dataset serves: manifest, tileset, subtrees and tiles.
#include <algorithm>
#include <cmath>

#include "pipeline/manifest_json.h"
#include "pipeline/subtree.h"
#include "pipeline/tileset.h"
#include "server/api.h"
#include "server/digest.h"
#include "server/json.h"

namespace cordillera::server {
namespace {

/// Addresses may be rebuilt under the same URL, so a client always asks; what has not changed costs it a 304.
constexpr const char* kCacheControl = "public, no-cache";

Response document(std::string bytes, const char* type, const std::string& etag) {
  Response response;
  response.set("Content-Type", type);
  response.set("Cache-Control", kCacheControl);
  response.set("ETag", quoted(etag));
  response.body = std::move(bytes);
  return response;
}

Response document(std::string bytes, const char* type) {
  const std::string etag = digest(bytes).substr(0, 32);
  return document(std::move(bytes), type, etag);
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

Response no_tile(const proto::Manifest& manifest, const Route& route) {
  const proto::TileAddress& tile = route.address;
  const auto least = static_cast<int>(manifest.min_level()), most = static_cast<int>(manifest.max_level());
  const bool inside = tile.z >= least && tile.z <= most;
  std::string accepted = "levels " + std::to_string(least) + " to " + std::to_string(most) + " within the dataset's bounds";
  for (int i = 0; i < 4 && manifest.bounds_size() >= 4; ++i) accepted += (i == 0 ? " " : ", ") + Json(manifest.bounds(i)).dump();
  accepted += range_text(manifest, inside ? tile.z : most) + " (y counts from the south); a tile without data does not exist";
  return problem_response({"tile-unknown",
                           "there is no tile at level " + std::to_string(tile.z) + ", x " + std::to_string(tile.x) + ", y " +
                               std::to_string(tile.y),
                           accepted, ""});
}

Response tile(const pipeline::StoreReader& reader, const Route& route) {
  auto blob = reader.tile(route.address, route.face);
  if (!blob) return no_tile(reader.manifest(), route);
  const char* type = route.face == pipeline::Face::glb ? "model/gltf-binary" : "application/octet-stream";
  return document(std::move(blob->bytes), type, blob->etag);
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
  const auto reader = service.library().open(dataset.id);
  if (!reader) return problem_response(reader.problem());
  const pipeline::StoreReader& store = **reader;
  switch (route.resource) {
    case Resource::manifest: return document(pipeline::manifest_json(store.manifest()), "application/json");
    case Resource::tileset: return document(pipeline::tileset_json(store), "application/json");
    case Resource::tile: return tile(store, route);
    default: break;
  }
  auto bytes = pipeline::subtree(store, route.hemisphere, route.address.z, route.address.x, route.address.y);
  if (!bytes) return no_tile(store.manifest(), route);
  return document(std::move(*bytes), "application/octet-stream");
}

}  // namespace cordillera::server
