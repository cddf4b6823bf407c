#pragma once
// Datasets as STAC (1.0.0) has them, in one collection, and the landing page of OGC API - Common above them. Links are absolute:
// readers of catalogs take documents out of their place.
#include <string>
#include <vector>

#include "pipeline/faces/face.h"
#include "server/datasets/library.h"
#include "server/datasets/registry.h"
#include "server/http/json.h"

namespace cordillera::server::stac {

/// Where a client sees the service: "https://example.org/terrain", or empty where it named no host; then links begin with a
/// slash.
struct ServiceRoot {
  std::string root;
};

/// What there is to fetch of a dataset.
struct Offered {
  std::vector<const pipeline::faces::Face*> faces;
  bool archive = true;  ///< pictures of heights as one file, made when it is asked for
};

Json landing_page(const ServiceRoot& place);
Json conformance();
Json collection(const ServiceRoot& place);
Json collections(const ServiceRoot& place);
/// The item of a dataset that is ready.
Json item(const ServiceRoot& place, const Dataset& dataset, const proto::Manifest& manifest, const Offered& offered);
/// A page; self, next: its query and that of the one behind it, or empty.
Json item_list(const ServiceRoot& place, const std::vector<Json>& items, const std::string& self, const std::string& next);

}  // namespace cordillera::server::stac
