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
};

/// POST …/sources, PUT and DELETE …/sources/{source}: everything but the raster itself. `sources`: the rasters as they are
/// expected to be when its turn comes.
proto::Result<ChangeRequest> read_change(const Settings& server, const Request& request, const Dataset& dataset,
                                         const Route& route, const std::vector<proto::DatasetSource>& sources);

/// Where a raster of the dataset lies in its folder; no two are called alike.
std::string raster_path(const std::string& name);

}  // namespace cordillera::server::updates
