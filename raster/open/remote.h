#pragma once
// Rasters that lie elsewhere, as GDAL's file systems name them: /vsicurl/…, /vsis3/….
#include <optional>
#include <string>

#include "proto/result.h"
#include "raster/disk/private_folder.h"

namespace cordillera::raster {

/// Why one could not be opened or read: asks its storage anew, for GDAL remembers what it said. Nothing: the storage gives the
/// file. "raster-not-found": it has none. "storage-read": it does not answer, or gives no file now; another time it may. name:
/// what the user called it. heard: what GDAL said when it failed.
std::optional<proto::Problem> why_not_fetched(const std::string& path, const std::string& name, const std::string& heard);

/// What GDAL said when a part of a raster could not be fetched, without the part's name: the same problems; nothing where it said
/// something else.
std::optional<proto::Problem> told_of_network(const std::string& name, const std::string& heard);

/// A .zip or .gz in a storage, by its name: GDAL's own ways into archives are none.
bool is_remote_archive(const std::string& path);

/// All of the file, into the folder: its path there. Problems: those of why_not_fetched, and "storage-full".
proto::Result<std::string> fetched(const std::string& path, const std::string& name, const PrivateFolder& folder);

}  // namespace cordillera::raster
