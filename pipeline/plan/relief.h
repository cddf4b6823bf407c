#pragma once
// How high the terrain of a dataset is, and whether it has a sea, from a few places: enough to choose defaults by.
#include <optional>
#include <span>
#include <utility>

#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Sets seen_heights, from the samples of places; see sample_places.h. They stay empty where those hold no data.
void see_heights(std::span<const proto::Samples> places, proto::Plan& plan);

/// Whether somebody has to look: neither the options nor the datum say.
bool may_have_sea(const proto::BuildOptions& options, const proto::Source& source);
/// Whether a hundredth of the samples is still water of exactly 0 above the source's datum.
bool sees_sea(std::span<const proto::Samples> places, const proto::Lattice& lattice, raster::Source& source);
/// The lowest and the highest of them, metres; none: nothing was seen.
std::optional<std::pair<double, double>> seen_heights_m(const proto::Plan& plan);

}  // namespace cordillera::pipeline
