#pragma once
// The rasters that a command line names, examined.
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "proto/result.h"
#include "raster/mosaic/mosaic.h"
#include "server/options/options.h"

namespace cordillera::server {

enum class BadSource { refuse, skip };

struct Sources {
  std::vector<raster::MosaicMember> members;  ///< the one that wins first, as they were named
  std::vector<std::string> skipped;           ///< lines of what was left out
  std::vector<std::string> warnings;
  std::vector<std::string> notes;  ///< what the manifest is to say of them, besides
};

/// words: rasters, folders, lists; see raster/mosaic/source_list.h. Options that a list gives to a raster go over those of
/// settings; they may be crs, vertical_datum, nodata, voids, z_scale, z_offset. A raster beside the bbox is passed over. Rasters
/// that overlap and count their heights from different surfaces are warned of, with the difference where they meet.
proto::Result<Sources> examine_sources(const std::vector<std::string>& words, const Settings& settings, BadSource bad);

/// A build of them, with the settings' options: of the one raster, or of several with its members. Named as the first of the
/// words; what there is to warn of is told to stderr.
proto::Result<pipeline::BuildRequest> request_of(const std::vector<std::string>& words, const Settings& settings,
                                                 BadSource bad = BadSource::refuse);

}  // namespace cordillera::server
