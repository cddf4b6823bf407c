#pragma once
// The law of covering held against the raster: every sample farther than one cell of its level, in columns or in rows, from where
// there is no data lies under a triangle of its tile.
#include "pipeline/check/known_samples.h"
#include "pipeline/check/tile_laws.h"
#include "raster/source.h"

namespace cordillera::pipeline::check {

/// Reads the raster in windows, so a tile may be of any size. known: the source's; plan: window and finest_level.
void check_cover(const raster::Source& source, KnownSamples& known, const proto::Plan& plan, const CheckedTile& tile,
                 Report& report);

}  // namespace cordillera::pipeline::check
