// How far a dataset is: as a document, and as a stream of events.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>

#include "pipeline/faces/web_mercator.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/public_address.h"
#include "server/datasets/whole_share.h"
#include "server/fetch/addresses.h"
#include "server/http/conditions.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

constexpr auto kKeepAlive = std::chrono::seconds(10);  // proxies close connections on which nothing moves

/// What is known of a job that has not said anything yet. One that has just begun is told as queued: no stage that it may say
/// comes before that, so the stages that a client sees never go back. So is the next change of a dataset that is ready.
proto::Progress before_the_first(State state) {
  proto::Progress progress;
  progress.set_stage(to_string(state == State::running || state == State::ready ? State::queued : state));
  progress.set_seconds_left(-1);
  return progress;
}

/// Of a lazy one no less is done than its tiles tell: after a start of the service nobody has said anything.
ProgressHub::Snapshot with_tiles_told(Service& service, const Dataset& dataset, ProgressHub::Snapshot now) {
  const auto shown = is_lazy(dataset) ? service.library().provisional(dataset.id) : nullptr;
  if (!shown || !shown->manifest().has_done_blocks()) return now;
  proto::Progress made;
  made.set_stage("build");
  made.set_done(shown->manifest().done_blocks().share());
  made.set_total(1);
  now.share = std::max(now.share, whole_share(made));
  return now;
}

/// What is said of a dataset that is not finished. place: among those that wait.
Json progress_json(const Dataset& dataset, const ProgressHub::Snapshot& now, std::optional<std::size_t> place) {
  const proto::Progress progress =
      place ? before_the_first(State::queued) : now.progress.value_or(before_the_first(dataset.state));
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };  // they are sums
  Json json;
  json["stage"] = progress.stage();
  json["done"] = rounded(progress.done());
  json["total"] = rounded(progress.total());
  json["share"] = rounded(now.share);
  json["seconds_left"] = progress.seconds_left() < 0 || is_lazy(dataset) ? Json(nullptr) : Json(progress.seconds_left());
  json["place"] = place ? Json(*place) : Json(nullptr);
  return json;
}

/// What can be read of a dataset.
enum class Readable : std::uint8_t { nothing, provisional, all };

Json links_json(const std::string& path, Readable readable) {
  Json links;
  links["self"] = path;
  links["events"] = path + "/events";
  if (readable == Readable::nothing) return links;
  links["manifest"] = path + "/manifest.json";
  if (readable == Readable::all) links["mesh"] = path + "/mesh.glb";
  if (readable == Readable::all) links["pmtiles"] = path + ".pmtiles";
  links["tileset"] = path + "/tileset.json";
  links["drc"] = path + "/tiles/{z}/{x}/{y}.drc";
  links["glb"] = path + "/tiles/{z}/{x}/{y}.glb";
  return links;
}

/// Whether a name can stand for one of the braces.
bool fits(const std::string& brace, const std::string& name) {
  if (brace == "{root}") return name == "W" || name == "E";
  return std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// Whether a file of the folder has such a path. Tiles of one format lie at the same depth, so the first way down tells.
bool holds(const std::filesystem::path& folder, std::string_view path) {
  std::filesystem::path at = folder;
  while (path.find('{') != path.npos) {
    const std::string part(path.substr(0, path.find('/')));
    if (part.size() == path.size()) break;
    path.remove_prefix(part.size() + 1);
    if (part.front() != '{') {
      at /= part;
      continue;
    }
    std::error_code error;
    std::filesystem::directory_iterator child(at, error), end;
    while (!error && child != end && !fits(part, child->path().filename().string())) child.increment(error);
    if (error || child == end) return false;
    at = child->path();
  }
  std::error_code error;
  const std::size_t brace = path.rfind('}');
  if (brace == path.npos) return std::filesystem::is_regular_file(at / path, error);
  const std::string_view suffix = path.substr(brace + 1);
  std::filesystem::directory_iterator child(at, error), end;
  while (!error && child != end && !child->path().filename().string().ends_with(suffix)) child.increment(error);
  return !error && child != end;
}

/// Of what a folder has, without what is made on request.
Json only_in_folder(Json links, const std::string& folder) {
  const std::pair<const char*, const char*> kFiles[] = {
      {"tileset", "tileset.json"}, {"drc", "tiles/{z}/{x}/{y}.drc"}, {"glb", "tiles/{z}/{x}/{y}.glb"}};
  for (const char* made : {"mesh", "pmtiles"}) links.erase(made);
  for (const auto& [name, path] : kFiles) {
    if (!holds(folder, path)) links.erase(name);
  }
  return links;
}

const char* grid_name(pipeline::faces::Grid grid) {
  using pipeline::faces::Grid;
  if (grid == Grid::web_mercator || grid == Grid::web_mercator_south) return "WebMercatorQuad";
  return grid == Grid::geodetic ? "WorldCRS84Quad" : nullptr;
}

/// A link as OGC API - Tiles has it. Geodetic rows count from the south, which the name of the tile matrix set does not say.
Json link_json(const std::string& path, const pipeline::faces::Resource& resource) {
  const bool templated = resource.grid != pipeline::faces::Grid::none;
  Json link;
  link["rel"] = templated ? "item" : "alternate";
  link["href"] = path + "/" + std::string(resource.path);
  link["type"] = std::string(resource.type);
  link["title"] = std::string(resource.about);
  if (!templated) return link;
  link["templated"] = true;
  if (const char* set = grid_name(resource.grid)) link["tileMatrixSetId"] = set;
  link["rows"] = resource.grid == pipeline::faces::Grid::web_mercator ? "north" : "south";
  return link;
}

/// What a build without a title is called in its manifest, too.
const std::string& title_or_name(const std::string& title, const std::string& name) { return title.empty() ? name : title; }

/// The few numbers that a list of datasets shows; manifest.json has all.
Json summary_json(const proto::Manifest& manifest) {
  Json json;
  json["title"] = manifest.title();
  json["attribution"] = manifest.attribution();
  json["imagery"] = manifest.options().imagery();
  json["min_level"] = manifest.min_level();
  json["max_level"] = manifest.max_level();
  json["bounds"] = std::vector<double>(manifest.bounds().begin(), manifest.bounds().end());
  json["tiles"] = manifest.tiles();
  json["triangles"] = manifest.triangles();
  json["bytes"] = manifest.bytes();
  return json;
}

/// id: a line of its own, or nothing.
std::string event_text(const std::string& name, const Json& data, const std::string& id = "") {
  return "event: " + name + "\n" + id + "data: " + plain_numbers(data).dump(-1, ' ', false, Json::error_handler_t::replace) +
         "\n\n";
}

/// The last event of a stream. Its id is a function of what it says: who has seen it is not told again.
struct LastEvent {
  std::string id, text;
};

LastEvent last_event(const std::string& name, const Json& data) {
  const std::string id = digest(event_text(name, data)).substr(0, 16);
  return {id, event_text(name, data, "id: " + id + "\n")};
}

/// How the dataset has ended; nullopt: it is being built or changed.
std::optional<LastEvent> end_of(Service& service, const Dataset& dataset, const std::string& path) {
  if (dataset.state == State::failed) return last_event("failed", problem_json(dataset.problem.value_or(proto::Problem{})));
  if (dataset.state != State::ready || updates::is_busy(service.ledger(), dataset.id)) return std::nullopt;
  return last_event("ready", status_json(service, dataset, path));
}

/// One client's stream: what it has seen, and whether it has seen the end.
class EventStream {
 public:
  EventStream(Service& service, const Request& request, std::string id, Token token)
      : service_(service), id_(std::move(id)), path_(public_path(request, id_)), asks_(request), token_(std::move(token)) {
    asks_.read_body = nullptr;  // it does not outlive the request
  }

  /// Empty: nothing new.
  std::optional<std::string> next() {
    if (ended_ || service_.stopping()) return std::nullopt;
    // The version is read before the state: a change in between is then news again, and never lost.
    const auto now = service_.hub().now(id_);
    const bool silent = std::chrono::steady_clock::now() - said_ >= kKeepAlive;
    const auto place = !started_ || place_ ? service_.queue().place(id_) : std::nullopt;
    const bool same = started_ && now.version == seen_ && place == place_;
    if (same && !silent) return "";
    said_ = std::chrono::steady_clock::now();
    if (same && visible()) return ": waiting\n\n";
    started_ = true;
    seen_ = now.version;
    place_ = service_.queue().place(id_);
    const Row dataset = visible();
    const std::string tiles = dataset ? new_tiles(*dataset) : "";
    const auto end = dataset ? end_of(service_, *dataset, path_) : last_event("failed", problem_json(unknown_dataset(id_)));
    ended_ = end.has_value();
    if (end) return tiles + end->text;
    Json data = progress_json(*dataset, with_tiles_told(service_, *dataset, now), place_);
    data["state"] = to_string(dataset->state);
    if (is_shown_lazily(service_, *dataset)) data["build"] = kLazy;
    return tiles + event_text("progress", data);
  }

 private:
  /// The dataset; null: there is none any more, or it is not for this client, whose token may be gone since the stream began.
  Row visible() {
    const Row dataset = service_.find(id_);
    const auto who = service_.gate().identify(asks_);
    if (!dataset || !who) return nullptr;
    asks_.who = *who;
    return may_see(asks_, *dataset) ? dataset : nullptr;
  }

  /// Where there is something else to be read than this client knows of.
  std::string new_tiles(const Dataset& dataset) {
    std::shared_ptr<const pipeline::faces::Terrain> terrain;
    if (dataset.state == State::queued || dataset.state == State::running) terrain = service_.library().provisional(id_);
    if (dataset.state == State::ready && !told_.empty()) {
      if (auto ready = service_.library().open(id_)) terrain = *ready;
    }
    std::string event = terrain ? event_text("tiles", tiles_json(terrain->manifest())) : told_;
    return event == told_ ? "" : told_ = std::move(event);
  }

  Service& service_;
  std::string id_, path_;
  Request asks_;  ///< who it is
  Token token_;
  std::uint64_t seen_ = 0;
  std::optional<std::size_t> place_;              ///< that was told
  std::chrono::steady_clock::time_point said_{};  ///< the last piece
  std::string told_;                              ///< the last event of tiles
  bool started_ = false;
  bool ended_ = false;
};

}  // namespace

double share_made(Service& service, const Dataset& dataset) {
  return with_tiles_told(service, dataset, service.hub().now(dataset.id)).share;
}

bool is_built_lazily(Service& service, const Dataset& dataset) {
  if (service.live().is_asleep(dataset.id)) return true;
  if (!is_lazy(dataset)) return false;
  const auto shown = service.library().provisional(dataset.id);
  return shown && shown->manifest().has_done_blocks();
}

bool may_be_built_lazily(Service& service, const Dataset& dataset) {
  if (is_built_lazily(service, dataset)) return true;
  const auto shown = service.library().provisional(dataset.id);
  if (!is_lazy(dataset) || (shown && shown->manifest().at_once())) return false;
  const auto now = service.hub().now(dataset.id);
  const std::string stage = now.progress ? now.progress->stage() : "";
  return stage != "build" && stage != "merge" && stage != "publish";  // else there would be blocks
}

bool is_shown_lazily(Service& service, const Dataset& dataset) {
  const bool shown = service.library().provisional(dataset.id) != nullptr || service.live().is_asleep(dataset.id);
  return shown && may_be_built_lazily(service, dataset);
}

Json status_json(Service& service, const Dataset& dataset, const std::string& path) {
  Json json;
  json["id"] = dataset.id;
  json["name"] = dataset.name;
  json["title"] = title_or_name(dataset.options.title(), dataset.name);
  json["state"] = to_string(dataset.state);
  json["created"] = dataset.created;
  json["private"] = dataset.is_private;
  const auto now = with_tiles_told(service, dataset, service.hub().now(dataset.id));
  const Json changes = updates::status(service, dataset.id);
  const bool changing = changes.is_object() && changes["pending"] > 0;
  const bool unfinished = dataset.state == State::queued || dataset.state == State::running || changing;
  json["progress"] = unfinished ? progress_json(dataset, now, service.queue().place(dataset.id)) : Json(nullptr);
  json["error"] = dataset.problem ? problem_json(*dataset.problem) : Json(nullptr);
  const bool building = dataset.state == State::queued || dataset.state == State::running;
  const bool provisional = building && service.library().provisional(dataset.id) != nullptr;
  json["provisional"] = provisional;
  json["asleep"] = building && service.live().is_asleep(dataset.id);
  json["source"] = dataset.address.empty() ? Json(nullptr) : Json(updates::without_query(dataset.address));
  json["build"] = building && may_be_built_lazily(service, dataset) ? kLazy : kFull;
  json["links"] = links_json(path, dataset.state == State::ready ? Readable::all
                                   : provisional                 ? Readable::provisional
                                                                 : Readable::nothing);
  const std::string folder = service.mounts().folder(dataset.id);
  if (!folder.empty()) json["links"] = only_in_folder(json["links"], folder);
  if (changes.is_object()) json["updates"] = changes;
  json["notes"] = std::vector<std::string>(dataset.options.warnings().begin(), dataset.options.warnings().end());
  json["manifest"] = nullptr;
  if (dataset.state != State::ready) return json;
  const auto summary = service.library().summary(dataset.id);
  if (summary) {
    const proto::Manifest& manifest = (*summary)->manifest;
    json["title"] = title_or_name(manifest.title(), dataset.name);
    json["manifest"] = summary_json(manifest);
    json["notes"] = std::vector<std::string>(manifest.notes().begin(), manifest.notes().end());
    json["version"] = (*summary)->version;
    if (folder.empty()) json["links"]["version"] = path + "/versions/" + (*summary)->version;
    if (!pipeline::faces::extent_of(manifest)) json["links"].erase("pmtiles");
  } else {
    json["error"] = problem_json(summary.problem());
  }
  return json;
}

std::vector<Part> parts_of(const Mounts& mounts, const std::string& id, const proto::Manifest& manifest) {
  using pipeline::faces::Grid;
  const std::string folder = mounts.folder(id);
  const bool has_maps = pipeline::faces::extent_of(manifest).has_value();
  std::vector<Part> parts;
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    if (!has_maps && pipeline::faces::is_of_maps(*face)) continue;
    Part part{face, {}};
    bool tiles = false, of_tiles = false;  // a document that other formats have, too, is no format
    for (const auto& resource : face->resources) {
      const bool there = folder.empty() || holds(folder, resource.path);
      if (there) part.resources.push_back(&resource);
      of_tiles = of_tiles || resource.grid != Grid::none;
      tiles = tiles || (there && resource.grid != Grid::none);
    }
    if (tiles == of_tiles && (folder.empty() || holds(folder, face->entry))) parts.push_back(std::move(part));
  }
  return parts;
}

Json faces_json(const std::vector<Part>& parts, const std::string& path) {
  Json faces = Json::array();
  for (const Part& part : parts) {
    const auto entry = pipeline::faces::find(part.face->entry);
    Json json;
    json["name"] = std::string(part.face->name);
    json["about"] = std::string(part.face->about);
    json["href"] = path + "/" + std::string(part.face->entry);
    json["type"] = entry ? std::string(entry->resource->type) : "application/json";
    json["links"] = Json::array();
    for (const pipeline::faces::Resource* resource : part.resources) json["links"].push_back(link_json(path, *resource));
    faces.push_back(std::move(json));
  }
  return faces;
}

Response status_document(Service& service, const Request& request, const Dataset& dataset) {
  const std::string path = public_path(request, dataset.id);
  Json json = status_json(service, dataset, path);
  const auto list_faces = [&](const proto::Manifest& manifest) {
    json["faces"] = faces_json(parts_of(service.mounts(), dataset.id, manifest), path);
  };
  if (dataset.state == State::ready) {
    if (const auto summary = service.library().summary(dataset.id)) list_faces((*summary)->manifest);
  } else if (const auto shown = service.library().provisional(dataset.id); shown && json["provisional"] == true) {
    list_faces(shown->manifest());
  }
  return guarded_json(std::move(json));
}

Response event_stream(Service& service, const Request& request, const Dataset& dataset) {
  // An EventSource asks again when a stream ends. 204 is how it is told that nothing more comes.
  const auto seen = request.header("last-event-id");
  const auto end = seen ? end_of(service, dataset, public_path(request, dataset.id)) : std::nullopt;
  if (end && end->id == *seen) {
    Response nothing_new;
    nothing_new.status = 204;
    nothing_new.set("Cache-Control", "no-store");
    return nothing_new;
  }
  Token token = service.wait_token();
  if (!token) {
    return problem_response(
        {"service-busy", "too many clients are waiting for events", "asking GET /v1/datasets/{id} now and then", ""});
  }
  Response response;
  response.set("Content-Type", "text/event-stream");
  response.set("Cache-Control", "no-store");
  response.set("X-Accel-Buffering", "no");  // a proxy that collects the stream would defeat it
  const auto stream = std::make_shared<EventStream>(service, request, dataset.id, std::move(token));
  response.next_piece = [stream] { return stream->next(); };
  return response;
}

}  // namespace cordillera::server
