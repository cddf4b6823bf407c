#pragma once
// The API of datasets whose rasters can be changed: …/sources, …/versions, …/rollback.
#include "server/api/requests/delivery.h"
#include "server/api/requests/routes.h"
#include "server/datasets/more_rasters.h"
#include "server/datasets/registry.h"
#include "server/http/message.h"

namespace cordillera::server::updates {

class Ledger;

/// Makes a dataset that is about to be kept one whose rasters can be changed: its folder gets the first change. dataset.raster:
/// where it lies then.
/// more: rasters behind it, in the upload's folder.
proto::Result<void> begin_dataset(Dataset& dataset, const Delivery& delivery, Upload& upload,
                                  const std::vector<MoreRaster>& more);
/// What a raster is called by its address: "dem.tif" of https://example.org/dem.tif?x=1 and of …/dem.tif;x=1.
/// Escapes are decoded, where that gives UTF-8.
std::string name_in(const std::string& address);
/// What a raster is called by where it comes from: an upload's filename, or an address. Empty: nothing says.
std::string name_of(Service& service, const Delivery& delivery);
/// Whether this very request was made before with its Idempotency-Key, and is answered as it was then.
bool is_repeated(Service& service, const Request& request, const Dataset& dataset);
/// 404: the dataset has no such raster.
proto::Problem unknown_source(const Dataset& dataset, const std::string& source);

/// …/sources and …/sources/{source}: the rasters, the one that wins first, and changes of them.
Response sources(Service& service, const Request& request, const Dataset& dataset, const Route& route);
/// …/versions: the one that is served and those that are kept.
Response versions(Service& service, const Request& request, const Dataset& dataset);
/// POST …/rollback: back to a kept version.
Response rollback(Service& service, const Request& request, const Dataset& dataset);

/// For a dataset's status: its number of changes under way and how the last one ended; null of one whose rasters are fixed,
/// and where that is damaged.
Json status(Service& service, const std::string& id);
/// Whether a change is pending.
bool is_busy(Ledger& ledger, const std::string& id);

/// Only who posted a dataset, or an admin, changes it.
std::optional<proto::Problem> refuse(const Request& request, const Dataset& dataset);

}  // namespace cordillera::server::updates
