#pragma once
// A request that changes a dataset's rasters, checked, and as a change for the ledger.
#include "server/api/requests/delivery.h"
#include "server/api/requests/routes.h"
#include "server/datasets/registry.h"
#include "work.pb.h"

namespace cordillera::server::updates {

struct ChangeRequest {
  Delivery delivery;
  proto::SourceChange change;
  bool known = true;  ///< the dataset will have the raster that is to be changed when its turn comes
};

/// POST …/sources, PUT and DELETE …/sources/{source}: everything but the raster itself.
proto::Result<ChangeRequest> read_change(Service& service, const Request& request, const Dataset& dataset, const Route& route);

/// Of everything in a request but its body.
std::string hash_of(const Request& request);
/// A key is its owner's alone.
std::string own_key(const Request& request, const std::string& key);

/// Where a raster of the dataset lies in its folder; no two are called alike.
std::string raster_path(const std::string& name);

}  // namespace cordillera::server::updates
