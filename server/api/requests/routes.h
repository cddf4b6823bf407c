#pragma once
// Which resource a path names.
#include <string>
#include <string_view>

#include "pipeline/faces/face.h"
#include "server/http/dataset_id.h"

namespace cordillera::server {

enum class Endpoint {
  none,
  index,        ///< /v1
  health,       ///< /healthz
  readiness,    ///< /readyz
  description,  ///< /api
  metrics,      ///< /metrics
  limits,       ///< /v1/limits
  live,         ///< /v1/live and what is below it
  uploads,      ///< /v1/uploads
  upload,       ///< /v1/uploads/{id}
  datasets,     ///< /v1/datasets
  dataset,      ///< /v1/datasets/{id}
  events,       ///< …/events
  manifest,     ///< …/manifest.json
  sources,      ///< …/sources
  source,       ///< …/sources/{source}
  versions,     ///< …/versions
  rollback,     ///< …/rollback
  elevation,    ///< …/elevation
  mesh,         ///< …/mesh.glb and others
  archive,      ///< /v1/datasets/{id}.pmtiles
  stac,         ///< /stac and what is below it
  demo,         ///< …/demo/{client}.html
  face,         ///< whatever a face has below …/{id}
  page,         ///< the viewer and its files
};

struct Route {
  Endpoint endpoint = Endpoint::none;
  std::string id;
  std::string version;           ///< of …/{id}/versions/{version}/…; empty without one
  std::string path;              ///< what follows …/{id}/ or the version; of stac, what follows /stac/, of live /v1/live
  pipeline::faces::Found found;  ///< of a face
};

/// A path of the API that is spelt wrongly is Endpoint::none; everything outside /v1 is a page.
Route parse_route(std::string_view path);

/// For metrics and logs: one name for all addresses of a resource; a face's own.
std::string route_name(const Route& route);

/// The methods a resource answers, as the Allow header has them.
std::string allowed_methods(Endpoint endpoint);

}  // namespace cordillera::server
