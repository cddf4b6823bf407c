#pragma once
// The HTTP API as a function: Request -> Response. Thread-safe. What waits for a build gives a Response that is asked again.
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/api/requests/routes.h"
#include "server/http/message.h"
#include "server/service/service.h"
#include "server/uploads/tus.h"

namespace cordillera::server {

class Api {
 public:
  explicit Api(Service& service) : service_(service) {}

  /// route: the request's, as route_meant has it. client is the peer's address; id and who are found out here.
  Response handle(Request request, Route route);
  Response handle(Request request);
  /// Whether handle() only looks something up: microseconds, and never waits.
  bool is_quick(const Request& request, const Route& route) const;
  /// Another after every change of what datasets serve.
  std::uint64_t state() const { return service_.library().changes(); }
  /// An answer that says same_while is given to this request too, by whoever kept it: names and counts it. State and path were
  /// looked at.
  void given_again(const Request& request, const metrics::KeptCounts& counts, Response& response);
  /// Called, on any thread, when an answer that is still to come or a stream may have something to say; null: nobody any more.
  void on_change(std::function<void()> listener) { service_.hub().listen(std::move(listener)); }

 private:
  /// Finds out who asks, and whether they may.
  std::optional<proto::Problem> admit(Request& request, const Route& route);
  Response answer(Request& request, const Route& route);
  struct Asked;
  Response finished(const std::shared_ptr<Asked>& asked, Response response);
  Response asked_anew(const std::shared_ptr<Asked>& asked, Response response);
  Response dispatch(const Request& request, const Route& route);

  Service& service_;
};

// The parts, a file each.

/// What stands in every answer, and what is told of it: request id, safe headers, log, audit, metrics.
struct Exchange {
  const Request& request;
  const Route& route;
  std::uint64_t received = 0;  ///< bytes of the body
  double seconds = 0;
};
void finish(Service& service, const Exchange& exchange, Response& response);
/// Reading is open to pages of every origin, with the headers of the answer.
void add_cors(Response& response);
/// Whether the request may know of the dataset: a private one is nobody's but its owner's and an admin's.
bool may_see(const Request& request, const Dataset& dataset);

/// GET /v1, /healthz, /readyz, /metrics, /v1/limits.
Response index(const Request& request);
Response alive();
Response readiness(Service& service);
Response metrics_text(Service& service);
Response limits_in_effect(Service& service);

/// The client to which an upload is counted: its token, or its address.
std::string sender(const Request& request);
/// Bytes, as a header announces them; nullopt: in more than 18 digits.
std::optional<std::uint64_t> announced_bytes(const std::string& length);
uploads::Bounds upload_bounds(const Limits& limits, const Request& request);
/// POST /v1/datasets. id: what the dataset is to be called, which none is yet; empty: a name that nobody can guess.
Response post_dataset(Service& service, const Request& request, const std::string& id = "");
/// DELETE /v1/datasets/{id}, for who posted it or an admin.
Response remove_dataset(Service& service, const Request& request, const Dataset& dataset);
/// All of it. False: the deletion cannot be written down, and nothing was changed.
bool delete_dataset(Service& service, const std::string& id);

/// What a build of the raster in the folder would make; nothing is kept.
Response dry_run(JobQueue& queue, const Request& request, const proto::Job& job, const std::filesystem::path& folder);

/// The answer to who wants to change a dataset that is only read here; none: it may be changed.
std::optional<Response> refuse_mounted(const Dataset& dataset);

/// GET …/events.
Response event_stream(Service& service, const Request& request, const Dataset& dataset);

/// A dataset to be read, or the answer that says why it cannot be: unfinished, failed, or of another version than the route's.
struct Opened {
  std::shared_ptr<const pipeline::faces::Terrain> terrain;  ///< null: refused
  Response refusal;
};
Opened open_published(Service& service, const Dataset& dataset, const Route& route);
/// The same, or what is shown of it while it is being built: its manifest says which (provisional).
Opened open_readable(Service& service, const Dataset& dataset, const Route& route);
/// Cache-Control of a document or a tile. Below a version it is kept for ever; else a client asks each time, and gets a 304 for
/// what has not changed.
const char* cache_control(const Route& route);

/// How long a request may wait for what is still to be made: as its Prefer says, within the operator's limit, or else so long.
struct MayWait {
  std::chrono::seconds longest{0};
  bool preferred = false;  ///< the client says so itself
};
MayWait may_wait(const Limits& limits, const Request& request);
/// The same for what is made of a whole dataset and may take minutes: a HEAD waits for none of it, and who names no time for less
/// than proxies do.
MayWait may_wait_for_whole(const Limits& limits, const Request& request);

/// Tiles that one request looks at; it looks at others when these are made.
inline constexpr std::size_t kMostLooks = 64;
/// What a request waits for, of a dataset that is being built.
struct Awaited {
  std::vector<proto::TileAddress> tiles;  ///< that are looked at for as long
  /// Whether what is shown of the dataset still lacks something that is waited for. shown: null where nothing is shown yet.
  std::function<bool(const Dataset& dataset, const pipeline::faces::Terrain* shown)> lacks;
  std::optional<proto::TileAddress> alone{};  ///< the answer is made of this tile and of no other
  bool all = false;                           ///< of the dataset
};
/// All of the tiles, in their final form.
Awaited all_of(std::vector<proto::TileAddress> tiles);
/// An answer that is still to come: when all is there the API is asked anew. When the time is over it is asked anew, too, if the
/// client named no time and something is shown by then; else the answer is not_made_yet(). None: the request is not to wait, has
/// waited, or too many do.
std::optional<Response> wait_for(Service& service, const Request& request, const Dataset& dataset, const MayWait& wait,
                                 Awaited awaited);
/// The same for what is made of the whole dataset. A lazy one has its blocks made as long as somebody asks; of others, who names
/// a time waits.
std::optional<Response> wait_for_all(Service& service, const Request& request, const Dataset& dataset);
/// A request of /v1/live, as one of the dataset that its address and its options name; where there is none yet it is made.
struct Live {
  Request request;
  Route route;
  std::optional<Response> answer;  ///< that says it already
};
Live live_dataset(Service& service, const Request& request, const Route& route);
/// Until something of the dataset can be read, within the limit; then the API is asked anew. Who asks for a tile waits for it, or
/// for what stands in its place: awaited_tile(). None: it can be read, or will never be, or was waited for.
std::optional<Response> wait_until_read(Service& service, const Request& request, const Dataset& dataset, const Route& route);
/// What who asks for a tile waits for; none of a document. Who names a time (Prefer: wait) waits for its final form, others for
/// that or for a provisional tile in its place.
std::optional<Awaited> awaited_tile(const Request& request, const Route& route);
/// What has this tile of the finest level in its final form although its block is not done; null: nothing.
std::shared_ptr<const pipeline::faces::Terrain> ahead_of_block(Library& library, const std::string& id,
                                                               const proto::Manifest& shown, const proto::TileAddress& tile);

/// 503, and when to ask again.
Response not_made_yet(Service& service, const Dataset& dataset);
/// Whether a tile is still to come in its final form. Of a lazy dataset those above all blocks are not: no look makes them.
bool is_to_come(const Dataset& dataset, const proto::Manifest* shown, const proto::TileAddress& tile);

/// The manifest and the faces of a dataset that is ready, or provisional ones; of a mounted folder of finished tiles its files.
Response published(Service& service, const Request& request, const Dataset& dataset, const Route& route);

/// …/mesh.glb and others: a part of a dataset as one mesh. While the dataset is built, of a level that its blocks have: those
/// that the mesh lies in are made next, and waited for.
Response extracted_mesh(Service& service, const Request& request, const Dataset& dataset, const Route& route);

/// GET /v1/datasets/{id}.pmtiles.
Response archive(Service& service, const Request& request, const Dataset& dataset, const Route& route);
/// For answers of a private dataset: caches between here and the client must not hand them on.
void keep_from_others(Response& response);

/// …/elevation: heights at places and along lines. GET and POST alike read only.
Response elevation(Service& service, const Request& request, const Dataset& dataset, const Route& route);

/// Makes the tile templates of a document absolute, for readers that do not resolve them; without a host in the request they
/// stay.
void make_absolute(const Request& request, Response& response);

/// GET /v1/datasets/{id}.
Response status_document(Service& service, const Request& request, const Dataset& dataset);
/// PATCH /v1/datasets/{id}: title, attribution, imagery, private.
Response describe_dataset(Service& service, const Request& request, const Dataset& dataset);
/// How much of a build is done, 0 to 1.
double share_made(Service& service, const Dataset& dataset);
/// Whether blocks are made as their tiles are asked for. Those that cannot be shown one by one are made at once, whatever was
/// asked for.
bool is_built_lazily(Service& service, const Dataset& dataset);
/// The same as far as it is known: also before blocks are made, of what is to be lazy and not said to be shown at once.
bool may_be_built_lazily(Service& service, const Dataset& dataset);
/// The same of what can be read by now, or is asleep: as far as is known, nothing more is built before somebody reads it.
bool is_shown_lazily(Service& service, const Dataset& dataset);
/// State, progress, error, links and, once it is ready, a summary. path: the dataset's, as the client sees it (public_path).
Json status_json(Service& service, const Dataset& dataset, const std::string& path);

/// A face that a dataset has, with those of its resources that there are.
struct Part {
  const pipeline::faces::Face* face;
  std::vector<const pipeline::faces::Resource*> resources;
};
/// All faces; of a mounted folder those that lie in it. Maps where the data is beyond Web Mercator are none.
std::vector<Part> parts_of(const Mounts& mounts, const std::string& id, const proto::Manifest& manifest);
/// What there is to fetch of a dataset, a face each, with links as OGC API names them. path as above.
Json faces_json(const std::vector<Part>& parts, const std::string& path);

/// An answer with a validator: 304 if the client has it already.
Response if_changed(const Request& request, Response response);
/// What the socket may compress has Vary, and a weak tag: compressed and plain, it is the same document in different bytes.
void mark_variants(Response& response);

/// unknown_dataset for one who may know of some datasets only.
proto::Problem unknown_to(const Request& request, const std::string& id);

}  // namespace cordillera::server
