#pragma once
// The HTTP API as a function: Request -> Response. Thread-safe; a request may wait (uploads, Prefer: wait, event streams).
#include <memory>
#include <optional>
#include <string>

#include "server/json.h"
#include "server/message.h"
#include "server/routes.h"
#include "server/service.h"

namespace cordillera::server {

class Api {
 public:
  explicit Api(Service& service) : service_(service) {}

  Response handle(const Request& request);
  /// What a request with a body can be refused for before a byte of it is read (Expect: 100-continue).
  std::optional<Response> refuse_early(const Request& request);

 private:
  Response dispatch(const Request& request, const Route& route);
  Response index() const;
  Response health(Resource resource);
  Response list(const Request& request);
  Response status(const std::string& id);
  Response remove(const std::string& id);

  Service& service_;
};

// The parts, a file each.

/// POST /v1/datasets.
Response post_dataset(Service& service, const Request& request);
/// What is wrong with a POST's query and headers.
std::optional<proto::Problem> check_post(Service& service, const Request& request);

/// What a build of the raster in the folder would make; nothing is kept.
Response dry_run(Service& service, const proto::Job& job, const std::filesystem::path& folder);

/// GET …/events.
Response event_stream(Service& service, const Dataset& dataset);

/// A dataset to be read, or the answer that says why it cannot be: unfinished, failed, or of another version than the route's.
struct Opened {
  std::shared_ptr<const pipeline::faces::Terrain> terrain;  ///< null: refused
  Response refusal;
};
Opened open_published(Service& service, const Dataset& dataset, const Route& route);
/// Names the build: what stands below …/versions/{it}/ never changes. Another program may make other bytes of the same build.
std::string version_of(const proto::Manifest& manifest);
/// Of a document or a tile: for ever below a version; else a client asks each time, and what has not changed costs it a 304.
const char* cache_control(const Route& route);

/// The manifest and the faces of a dataset that is ready.
Response published(Service& service, const Dataset& dataset, const Request& request, const Route& route);

/// …/mesh.glb and others: a part of a dataset as one mesh.
Response extracted_mesh(Service& service, const Dataset& dataset, const Request& request, const Route& route);

/// …/elevation: heights at places and along lines. GET and POST alike read only.
Response elevation(Service& service, const Dataset& dataset, const Request& request, const Route& route);

/// Makes the tile templates of a document absolute, for readers that do not resolve them; without a host in the request they stay.
void make_absolute(const Request& request, Response& response);

/// State, progress, error, links and, once it is ready, a summary. prefix: the dataset's address relative to the document's.
Json status_json(Service& service, const Dataset& dataset, const std::string& prefix);

/// What there is to fetch of a dataset, a face each, with links as OGC API names them. prefix as above.
Json faces_json(const std::string& prefix);

/// An answer with a validator: 304 if the client has it already.
Response if_changed(const Request& request, Response response);
/// What the socket may compress has Vary, and a weak tag: compressed and plain, it is the same document in different bytes.
void mark_variants(Response& response);

proto::Problem unknown_dataset(const std::string& id);

}  // namespace cordillera::server
