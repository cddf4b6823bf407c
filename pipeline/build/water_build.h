#pragma once
// Water masks of a dataset, finest level first, made once its tiles are there: a pass of its own, so that tiles cost and are what
// they are without it.
#include <atomic>
#include <string>

#include "pipeline/build/worker_sources.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Nothing without water= or water-mask=. With water= the pixels of exactly that height are water, with water-mask= those that
/// are not zero there; what neither raster covers is land. open: of the elevation model. Problems of the mask name the option.
proto::Result<void> build_water(const proto::Plan& plan, Workers& workers, const WorkerSources::Open& open, StoreWriter& store,
                                const std::atomic<bool>& stop);

/// The mask opens and lies somewhere: asked before hours of building. Nothing without water-mask=.
proto::Result<void> check_water(const proto::BuildOptions& options);

/// A sentence where the mask of water-mask= covers nothing of a source; else, and where the mask cannot be opened, nothing.
std::string note_on_mask(const proto::BuildOptions& options, const proto::Source& source);

}  // namespace cordillera::pipeline
