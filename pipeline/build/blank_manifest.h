#pragma once
// What a manifest says before any tile is built.
#include <optional>

#include "cordillera.pb.h"
#include "pipeline/build/build.h"
#include "raster/pixels/value_look.h"

namespace cordillera::pipeline {

/// What a build runs on, as far as it is no part of the plan.
struct Machine {
  unsigned threads = 0;
  std::string device;  ///< as gpu::Simplifier says it: "cpu" or "cuda:0 (NVIDIA …)"
};

/// All that request, plan and source tell; options with the values that are in effect, defaults included. What is measured is
/// left out.
proto::Manifest blank_manifest(const BuildRequest& request, const proto::Plan& plan, const proto::Source& source,
                               const Machine& machine);

/// A sentence on those of several rasters that are known to have no data.
std::optional<std::string> note_on_voids(const std::vector<raster::MosaicMember>& members);

/// A sentence on those that are finer than one before them that covers them: where that has data they are not shown.
std::optional<std::string> note_on_hidden(const std::vector<raster::MosaicMember>& members);

/// None: several rasters, or too much would have to be read.
std::optional<raster::ValueLook> look_at_values(raster::Source& source);
/// Of several. None: very many, or with several vertical datums, or too much would have to be read.
std::optional<raster::ValueLook> look_at_values(const std::vector<raster::MosaicMember>& members);
/// What a person should know of values that were looked at.
void note_values(const std::optional<raster::ValueLook>& look, proto::Manifest& manifest);
/// Of a build with a bbox whose voids are to be filled: whether it cuts some.
void note_cut_voids(raster::Source& source, const proto::Plan& plan, proto::Manifest& manifest);

}  // namespace cordillera::pipeline
