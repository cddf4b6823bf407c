#pragma once
// Whether a dataset is what it says: every checksum, record, border and bound, and its stated errors where the raster is at hand.
#include <functional>
#include <memory>
#include <string>

#include "pipeline/check/report.h"
#include "pipeline/progress/teller.h"
#include "proto/result.h"
#include "raster/source.h"

namespace cordillera::pipeline::check {

/// Opens what a dataset was built from, as its manifest's options say; none: it is not at hand.
using OpenRasters = std::function<proto::Result<std::unique_ptr<raster::Source>>(const proto::Manifest& manifest)>;

/// A dataset's .sqlite file. A Problem if it is none, or cannot be opened at all; what is wrong
/// inside is in the report. Reads the whole file. progress: stages "pages", "checksums" and "tiles", by the caller's thread; may
/// be empty.
proto::Result<Report> check_store(const std::string& path, const OpenRasters& rasters, const ProgressCallback& progress = {});

/// The part of it that takes no longer than reading does: pages, the hashes of all bytes, sums of rows. No tile is decoded.
proto::Result<Report> check_bytes(const std::string& path);

/// A static folder with .drc tiles and the .glb of `build`: no checksums and no records are there; the rest is held to the same
/// laws. progress: the stage "tiles", in the same way.
proto::Result<Report> check_folder(const std::string& folder, const OpenRasters& rasters, const ProgressCallback& progress = {});

}  // namespace cordillera::pipeline::check
