#pragma once
// A job whose raster is a list of others at their addresses, or a VRT of them.
#include <filesystem>
#include <functional>
#include <vector>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "raster/mosaic/mosaic.h"
#include "server/jobs/process/update_job.h"

namespace cordillera::server {

/// Reports what the job's raster names, and makes of a VRT one that names them by their numbers. Nothing reported: it is a
/// raster and no list.
proto::Result<void> report_listed(const proto::Job& job, const std::filesystem::path& folder,
                                  const std::function<void(const proto::Progress&)>& report);

/// From here on rasters that are there in parts are asked for as they are read. The folder of a list's becomes the process's own.
/// False: one is not there at all.
bool have_rasters(const proto::Job& job, const std::filesystem::path& folder);

/// The rasters of a list, the one that wins first; none where the job has one raster. After have_rasters(). check: of each.
proto::Result<std::vector<raster::MosaicMember>> examine_listed(const proto::Job& job, const updates::SizeCheck& check);

}  // namespace cordillera::server
