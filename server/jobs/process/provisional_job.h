#pragma once
// A job's first minute: tiles to look at before its build has any.
#include <atomic>
#include <filesystem>

#include "pipeline/build/build.h"

namespace cordillera::server {

/// Makes provisional tiles of the request's raster in the job's folder: in one file that is whole when it gets its name, first
/// few, then finer ones in its place, and reports each (Progress::provisional). source: the opened raster. Tiles that an earlier
/// attempt left are kept. A raster that has none, and what goes wrong with them, is no problem of the build, which reads all of
/// it and says more.
void make_provisional(const pipeline::BuildRequest& request, raster::Source& source, const std::filesystem::path& folder,
                      const pipeline::ProgressCallback& report, const std::atomic<bool>& stop);

}  // namespace cordillera::server
