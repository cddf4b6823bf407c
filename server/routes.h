#pragma once
// Which resource a path names.
#include <string>
#include <string_view>

#include "pipeline/store.h"
#include "proto/lattice.h"

namespace cordillera::server {

enum class Resource {
  none,
  index,        ///< /v1
  health,       ///< /healthz
  readiness,    ///< /readyz
  datasets,     ///< /v1/datasets
  dataset,      ///< /v1/datasets/{id}
  events,       ///< …/events
  manifest,     ///< …/manifest.json
  tileset,      ///< …/tileset.json
  subtree,      ///< …/subtrees/{W|E}/{level}/{x}/{y}.subtree
  tile,         ///< …/tiles/{z}/{x}/{y}.drc or .glb; …/tiles/{W|E}/{level}/{x}/{y}.glb
  page,         ///< the viewer and its files
};

struct Route {
  Resource resource = Resource::none;
  std::string id;
  char hemisphere = 0;                                ///< subtree: 'W' or 'E'; the address is then relative to that root
  proto::TileAddress address;                         ///< tile: absolute, y from the south
  pipeline::Face face = pipeline::Face::drc;
};

/// A path of the API that is spelt wrongly is Resource::none; everything outside /v1 is a page.
Route parse_route(std::string_view path);

/// The methods a resource answers, as the Allow header has them.
std::string allowed_methods(Resource resource);

}  // namespace cordillera::server
