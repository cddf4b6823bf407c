// What a published dataset serves: its manifest and its faces.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "pipeline/faces/mercator/mercator_draco.h"
#include "pipeline/faces/mercator/mercator_mesh.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/tileset/manifest_json.h"
#include "server/api/api.h"
#include "server/api/documents/web.h"
#include "server/api/requests/prefer.h"
#include "server/http/gzip.h"
#include "server/http/json.h"
#include "server/jobs/provisional.h"
#include "server/options/option_values.h"

namespace cordillera::server {
namespace {

Response answer(const pipeline::faces::Document& document, std::string_view type, const Route& route) {
  Response response;
  response.set("Content-Type", std::string(type));
  response.set("Cache-Control", cache_control(route));
  response.set("ETag", server::quoted(document.etag));
  response.shared = document.bytes.held();
  return response;
}

/// Columns and rows of a level that the dataset's bounds touch, as text.
std::string range_text(const proto::Manifest& manifest, int level) {
  const auto tiles = touched_by_bounds(manifest, level);
  if (!tiles) return "";
  const auto span = [](std::int32_t from, std::int32_t to) { return std::to_string(from) + ".." + std::to_string(to); };
  return "; at level " + std::to_string(level) + " x " + span(tiles->west, tiles->east) + ", y " +
         span(tiles->south, tiles->north);
}

/// Of Web Mercator's faces; none of a dataset that it cannot show. Pictures have those that their pixels are worth, meshes a zoom
/// a level.
pipeline::faces::Zooms zooms(const proto::Manifest& manifest, const pipeline::faces::Resource& tiles) {
  using namespace pipeline::faces;
  if (tiles.grid == Grid::web_mercator_south) return {0, finest_mercator_zoom(manifest)};
  if (!tiles.type.starts_with("image/") && tiles.type != kVectorTile) return mercator_draco_zooms(manifest);
  const auto extent = pipeline::faces::extent_of(manifest);
  return extent ? zooms_of(manifest, *extent) : pipeline::faces::Zooms{0, -1};
}

/// Levels or zooms at which there may be tiles of a resource.
pipeline::faces::Zooms levels_of(const proto::Manifest& manifest, const pipeline::faces::Resource& tiles) {
  using pipeline::faces::Grid;
  const bool mercator = is_mercator(tiles.grid);
  return mercator ? zooms(manifest, tiles)
                  : pipeline::faces::Zooms{static_cast<int>(manifest.min_level()), static_cast<int>(manifest.max_level())};
}

Response no_tile(const proto::Manifest& manifest, const pipeline::faces::Found& found, const Route& route) {
  if (found.resource->absent == pipeline::faces::Absent::no_content) {
    Response nothing;
    nothing.status = 204;
    nothing.set("Cache-Control", cache_control(route));
    return nothing;
  }
  const auto& [root, z, x, y, ramp, interval, normals] = found.place;
  using pipeline::faces::Grid;
  const bool north = found.resource->grid == Grid::web_mercator,
             mercator = north || found.resource->grid == Grid::web_mercator_south;
  const auto [least, most] = levels_of(manifest, *found.resource);
  const bool inside = z >= least && z <= most;
  const std::string so_far = manifest.provisional() ? "while the dataset is being built, " : "";
  std::string accepted = so_far + (mercator ? "zooms " : "levels ") + std::to_string(least) + " to " + std::to_string(most) +
                         " within the dataset's bounds";
  for (int i = 0; i < 4 && manifest.bounds_size() >= 4; ++i) accepted += (i == 0 ? " " : ", ") + Json(manifest.bounds(i)).dump();
  if (found.resource->grid == pipeline::faces::Grid::geodetic) accepted += range_text(manifest, inside ? z : most);
  accepted += north ? " (y counts from the north)" : " (y counts from the south); a tile without data does not exist";
  const std::string where =
      (root == 0 ? "" : " below the root " + std::string(1, root)) + (mercator ? " at zoom " : " at level ") + std::to_string(z);
  return problem_response(
      {"tile-unknown", "there is no tile" + where + ", x " + std::to_string(x) + ", y " + std::to_string(y), accepted, ""});
}

/// Milliseconds that a document took to make or find, for a browser's network panel.
void add_timing(Response& response, std::chrono::steady_clock::time_point start) {
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "make;dur=%.3f", took.count());
  response.set("Server-Timing", text.data());
  response.set("Timing-Allow-Origin", "*");
}

/// What a path names, and in which of its forms it is asked for.
struct Wanted {
  pipeline::faces::Found found;
  bool varies = false;      ///< with Accept-Encoding
  bool compressed = false;  ///< here, and not at the socket

  /// Of one form of one tile.
  std::string name() const {
    const pipeline::faces::Place& place = found.place;
    std::string name = path_of(*found.resource, place);
    for (const std::string_view asked : {place.ramp, place.interval, place.normals}) (name += '?') += asked;
    return compressed ? name + " gzip" : name;
  }
};

/// What the client has already, as far as its tag tells: the head of the answer, without reading a byte of the document.
std::optional<Response> unread(const pipeline::faces::Terrain& terrain, const Request& request, const Route& route,
                               const Wanted& wanted) {
  const pipeline::faces::Resource& resource = *wanted.found.resource;
  if (terrain.manifest().provisional() || !request.headers.contains("if-none-match")) return std::nullopt;
  auto tag = resource.tag != nullptr ? resource.tag(terrain, wanted.found.place) : terrain.known_tag(wanted.name());
  if (!tag) return std::nullopt;
  Response response = answer({{}, std::move(*tag)}, resource.type, route);
  if (wanted.varies) response.set("Vary", "Accept-Encoding");
  return if_changed(request, response).status == 304 ? std::optional(std::move(response)) : std::nullopt;
}

/// A value of the query, empty without it; it lives as long as the request.
std::string_view asked(const Request& request, std::string_view what) {
  for (const auto& [name, value] : request.query) {
    if (name == what) return value;
  }
  return {};
}

/// What the path names, with what the query says of it.
pipeline::faces::Found found_of(const Request& request, const Route& route) {
  pipeline::faces::Found found = route.found;
  if (!found.resource->ramps.empty()) found.place.ramp = asked(request, "ramp");
  if (!found.resource->intervals.empty()) found.place.interval = asked(request, "interval");
  if (!found.resource->normals.empty()) found.place.normals = asked(request, "normals");
  return found;
}

/// A word that the resource takes and the query nearly has. Clients add words of their own, so that none is refused.
std::optional<std::string> meant_word(const Request& request, const pipeline::faces::Resource& resource) {
  if (request.query.empty()) return std::nullopt;
  std::vector<std::string> taken;
  if (!resource.ramps.empty()) taken.emplace_back("ramp");
  if (!resource.intervals.empty()) taken.emplace_back("interval");
  if (!resource.normals.empty()) taken.emplace_back("normals");
  for (const auto& [name, value] : request.query) {
    auto nearest = nearest_name(name, taken);
    if (nearest && *nearest != name) return nearest;
  }
  return std::nullopt;
}

Response face(const pipeline::faces::Terrain& terrain, const Request& request, const Route& route) {
  Wanted wanted{found_of(request, route)};
  const pipeline::faces::Found& found = wanted.found;
  wanted.varies = found.resource->compression == pipeline::faces::Compression::gzip;
  wanted.compressed = wanted.varies && accepts_gzip(request);
  const auto start = std::chrono::steady_clock::now();
  if (!pipeline::faces::inside(found.resource->grid, found.place)) return no_tile(terrain.manifest(), found, route);
  if (auto unchanged = unread(terrain, request, route, wanted)) return std::move(*unchanged);
  auto made = found.resource->make(terrain, found.place);
  if (!made) return problem_response(made.problem());
  if (!*made) return no_tile(terrain.manifest(), found, route);
  const pipeline::faces::Document document = wanted.compressed ? gzipped(terrain, **made) : **made;
  const bool is_tile = found.resource->grid != pipeline::faces::Grid::none;
  if (is_tile && found.resource->tag == nullptr) terrain.note_tag(wanted.name(), document.etag);
  Response response = answer(document, found.resource->type, route);
  if (wanted.varies) response.set("Vary", "Accept-Encoding");
  if (wanted.compressed) response.set("Content-Encoding", "gzip");
  if (const auto meant = meant_word(request, *found.resource)) response.set("Cordillera-Hint", "did you mean " + *meant + "?");
  add_timing(response, start);
  return response;
}

/// version_of, worked out once.
std::string version_in(const pipeline::faces::Terrain& terrain) {
  const auto kept = terrain.kept("version", [&]() -> proto::Result<std::optional<pipeline::faces::Document>> {
    return std::optional(pipeline::faces::Document{version_of(terrain.manifest()), ""});
  });
  return (**kept).bytes;
}

/// What is made of its documents for some clients is kept with the dataset, and so forgotten with it.
Response::Keep keep_in(const std::shared_ptr<const pipeline::faces::Terrain>& terrain) {
  return [terrain](const std::string& name, const std::function<std::string()>& make) {
    const auto made = terrain->kept(name, [&]() -> proto::Result<std::optional<pipeline::faces::Document>> {
      return std::optional(pipeline::faces::Document{make(), ""});
    });
    return (**made).bytes.held();
  };
}

/// The tile of the lattice where a tile of a face is; none of documents.
std::optional<proto::TileAddress> on_lattice(pipeline::faces::Grid grid, const pipeline::faces::Place& place) {
  using pipeline::faces::Grid;
  switch (grid) {
    case Grid::none: return std::nullopt;
    case Grid::geodetic: return proto::TileAddress{place.z, place.x, place.y};
    case Grid::implicit: return proto::TileAddress{place.z, place.x + (place.root == 'E' ? 1 << place.z : 0), place.y};
    case Grid::web_mercator:
    case Grid::web_mercator_south: break;
  }
  const int level = std::max(place.z - 1, 0);  // two tiles at level 0: as wide
  const double row = grid == Grid::web_mercator ? place.y : std::ldexp(1, place.z) - 1 - place.y,
               tiles_a_degree = proto::tiles_up(level) / 180.0;
  const double east_deg = pipeline::faces::pixel_longitude_deg(place.z, (place.x + 0.5) * pipeline::faces::kTilePixels) + 180;
  const double north_deg = pipeline::faces::pixel_latitude_deg(place.z, (row + 0.5) * pipeline::faces::kTilePixels) + 90;
  return proto::TileAddress{level, static_cast<std::int32_t>(east_deg * tiles_a_degree),
                            static_cast<std::int32_t>(north_deg * tiles_a_degree)};
}

constexpr std::string_view kSubtree = ".subtree";  // says which tiles there are now, and waits for none

/// The tile where the path's is, or of a subtree its root.
std::optional<proto::TileAddress> tile_of(const Route& route) {
  if (route.found.resource == nullptr) return std::nullopt;
  const auto& [resource, place] = route.found;
  const auto tile = pipeline::faces::inside(resource->grid, place) ? on_lattice(resource->grid, place) : std::nullopt;
  return tile && tile->z > 0 ? tile : std::nullopt;
}

/// Whether the tile's final form is still to come. Where the levels are known, those finer than all are not waited for.
bool lacks(const Dataset& dataset, const proto::Manifest* shown, const Route& route, const proto::TileAddress& tile) {
  const bool offered =
      shown == nullptr || !shown->has_done_blocks() || route.found.place.z <= levels_of(*shown, *route.found.resource).last;
  return offered && is_to_come(dataset, shown, tile);
}

/// Whether a provisional tile stands there. Pictures are made of the finest level that covers them, meshes of their own.
bool has_stand_in(const pipeline::faces::Terrain& shown, const Route& route, const proto::TileAddress& tile) {
  const pipeline::faces::Resource& resource = *route.found.resource;
  const bool is_picture = resource.type.starts_with("image/") || resource.type == pipeline::faces::kVectorTile;
  if (is_picture) return route.found.place.z <= levels_of(shown.manifest(), resource).last;
  return shown.store().record(tile).has_value();
}

/// Whether the answer is made of the tile alone. Textures of normals are made of finer tiles, too.
bool is_of_tile_alone(const Request& request, const Route& route) {
  return route.found.resource->tag != nullptr && asked(request, "normals") != "texture";
}

/// Whether what stands there has the bytes that it has for good: of a done block what is made of the tile alone.
bool is_final(const proto::Manifest& shown, const Request& request, const Route& route, const proto::TileAddress& tile) {
  return is_of_tile_alone(request, route) && is_in_done_block(shown, tile);
}

/// What a dataset, finished or not, has for a route.
Response of_terrain(const std::shared_ptr<const pipeline::faces::Terrain>& terrain, const Request& request, const Route& route) {
  Response response =
      route.found.resource != nullptr
          ? face(*terrain, request, route)
          : answer(pipeline::faces::document(pipeline::manifest_json(terrain->manifest())), "application/json", route);
  if (response.shared && is_compressible(response.header("Content-Type"))) response.keep = keep_in(terrain);
  return response;
}

enum class Needs { all, anything };  ///< of a dataset: finished, or what of it can be read by now
std::optional<Response> not_ready(const Dataset& dataset, Needs needs) {
  if (dataset.state == State::ready) return std::nullopt;
  if (dataset.state == State::failed) {
    const std::string why = dataset.problem ? dataset.problem->detail : "its build failed";
    const std::string accepted = dataset.address.empty() ? "posting a raster that can be built"
                                                         : "asking later: its address is tried again, or another one";
    return problem_response({"dataset-failed", "dataset " + dataset.id + " has nothing to fetch: " + why, accepted, ""});
  }
  const std::string path = "/v1/datasets/" + dataset.id, is = "dataset " + dataset.id + " is " + to_string(dataset.state);
  if (!is_lazy(dataset)) return problem_response({"dataset-not-ready", is, "asking again when GET " + path + " says ready", ""});
  if (needs == Needs::anything)
    return problem_response(
        {"dataset-not-ready", is + ", and its first tiles are still to come", "asking again in a moment", ""});
  return problem_response({"dataset-not-ready", is + ", and its blocks are made as their tiles are asked for",
                           "PATCH " + path + "?build=full, and asking again when GET " + path + " says ready", ""});
}

/// A request of a dataset that is not built, or not to its end.
class Unfinished {
 public:
  Unfinished(Service& service, const Dataset& dataset, const Request& request, const Route& route, const MayWait& wait)
      : service_(service), dataset_(dataset), request_(request), route_(route), wait_(wait) {
    if (!route.version.empty() || (dataset.state != State::queued && dataset.state != State::running)) return;
    tile_ = tile_of(route);
    awaited_ = awaited_tile(request, route);
  }

  Response answer(const Opened& opened) const {
    if (opened.terrain) return of_what_is_shown(opened.terrain);
    auto put_off = wait_.preferred ? later() : std::nullopt;
    return put_off ? std::move(*put_off) : opened.refusal;
  }

 private:
  /// When the tile is made; none: it is not waited for, or too many wait.
  std::optional<Response> later() const {
    return awaited_ ? wait_for(service_, request_, dataset_, wait_, *awaited_) : std::nullopt;
  }

  Response of_what_is_shown(const std::shared_ptr<const pipeline::faces::Terrain>& terrain) const {
    const proto::Manifest& shown = terrain->manifest();
    const bool to_come = tile_ && lacks(dataset_, &shown, route_, *tile_);
    const auto ahead = to_come && awaited_ && awaited_->alone
                           ? ahead_of_block(service_.library(), dataset_.id, shown, *awaited_->alone)
                           : nullptr;
    if (ahead) return of_terrain(ahead, request_, route_);
    if (to_come)
      service_.queue().look(dataset_, {*tile_}, shown,
                            wait_.preferred ? JobQueue::Who::waits : JobQueue::Who::passes);  // a tile that is not there yet, too
    auto put_off = to_come && wait_.preferred ? later() : std::nullopt;
    if (put_off) return std::move(*put_off);
    Response response = of_terrain(terrain, request_, route_);
    if (to_come && awaited_ && is_lazy(dataset_) && is_missing(response, *terrain)) {
      put_off = later();
      return put_off ? std::move(*put_off) : not_made_yet(service_, dataset_);
    }
    if (!tile_ || !is_final(shown, request_, route_, *tile_)) mark_provisional(response);
    return response;
  }

  /// A picture of nothing is no content, too: where one of a coarser level stands in, nothing is what it shows.
  bool is_missing(const Response& response, const pipeline::faces::Terrain& shown) const {
    return response.status == 404 || (response.status == 204 && !has_stand_in(shown, route_, *tile_));
  }

  Service& service_;
  const Dataset& dataset_;
  const Request& request_;
  const Route& route_;
  const MayWait wait_;
  std::optional<proto::TileAddress> tile_;  ///< where the path's is
  std::optional<Awaited> awaited_;          ///< the same, if it can be waited for
};

/// Of a mounted folder of finished tiles: its files.
Response published_folder(Service& service, const Dataset& dataset, const Route& route, const std::string& folder) {
  if (!route.version.empty())
    return problem_response({"version-unknown", "dataset " + dataset.id + " is a folder of finished tiles: it has one version",
                             "the address without a version", ""});
  const bool of_face = route.found.resource != nullptr;
  auto file = file_of_folder(service.web_files(), folder, of_face ? route.path : "manifest.json",
                             of_face ? std::string(route.found.resource->type) : "application/json", cache_control(route));
  if (file) return std::move(*file);
  const auto manifest = service.mounts().manifest(dataset.id);
  if (!manifest) return problem_response(manifest.problem());
  std::error_code error;
  const bool has_format =
      of_face && std::filesystem::exists(std::filesystem::path(folder) / route.path.substr(0, route.path.find('/')), error);
  if (has_format && route.found.resource->grid != pipeline::faces::Grid::none) return no_tile(*manifest, route.found, route);
  return problem_response(service.library().open(dataset.id).problem());
}

Opened open_built(Service& service, const Dataset& dataset, const Route& route, Needs needs) {
  if (auto refusal = not_ready(dataset, needs)) return {nullptr, std::move(*refusal)};
  const auto terrain = service.library().open(dataset.id);
  if (!terrain) return {nullptr, problem_response(terrain.problem())};
  if (!route.version.empty() && route.version != version_in(**terrain)) {
    if (const auto kept = service.archive().find(dataset.id, route.version)) return {kept, {}};
    return {nullptr, problem_response({"version-unknown", "dataset " + dataset.id + " has no version " + route.version,
                                       version_in(**terrain), ""})};
  }
  return {*terrain, {}};
}

}  // namespace

const char* cache_control(const Route& route) {
  return route.version.empty() ? "public, no-cache" : "public, max-age=31536000, immutable";
}

Opened open_published(Service& service, const Dataset& dataset, const Route& route) {
  return open_built(service, dataset, route, Needs::all);
}

Opened open_readable(Service& service, const Dataset& dataset, const Route& route) {
  if (dataset.state == State::ready || dataset.state == State::failed || !route.version.empty())
    return open_published(service, dataset, route);
  if (auto terrain = service.library().provisional(dataset.id)) return {std::move(terrain), {}};
  // It may have become ready since it was looked up, and the provisional tiles have gone for that.
  const Row now = service.find(dataset.id);
  return open_built(service, now ? *now : dataset, route, Needs::anything);
}

std::optional<Awaited> awaited_tile(const Request& request, const Route& route) {
  const auto tile = tile_of(route);
  if (!tile || route.found.resource->path.ends_with(kSubtree)) return std::nullopt;
  const bool takes_stand_in = !preferred_wait(request);
  Awaited awaited{{*tile}, [route, tile = *tile, takes_stand_in](const Dataset& dataset, const pipeline::faces::Terrain* shown) {
                    if (shown != nullptr && takes_stand_in && has_stand_in(*shown, route, tile)) return false;
                    return lacks(dataset, shown == nullptr ? nullptr : &shown->manifest(), route, tile);
                  }};
  if (is_of_tile_alone(request, route)) awaited.alone = tile;
  return awaited;
}

Response published(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  const std::string folder = service.mounts().folder(dataset.id);
  if (!folder.empty()) return published_folder(service, dataset, route, folder);
  const Opened opened = open_readable(service, dataset, route);
  if (opened.terrain && !opened.terrain->manifest().provisional()) return of_terrain(opened.terrain, request, route);
  return Unfinished(service, dataset, request, route, may_wait(service.settings().serve.limits, request)).answer(opened);
}

}  // namespace cordillera::server
