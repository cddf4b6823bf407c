#pragma once
// Whether a dataset is what it says: every checksum, record, border and bound, and its stated errors where the raster is at hand.
#include <string>

#include "pipeline/check/report.h"
#include "proto/result.h"

namespace cordillera::pipeline::check {

/// A dataset's .sqlite file. raster: of the build, or empty. A Problem if it is none, or cannot be opened at all; what is wrong
/// inside is in the report. Reads the whole file.
proto::Result<Report> check_store(const std::string& path, const std::string& raster);

/// A static folder with .drc tiles and the .glb of `build`: no checksums and no records are there; the rest is held to the same
/// laws.
proto::Result<Report> check_folder(const std::string& folder, const std::string& raster);

}  // namespace cordillera::pipeline::check
