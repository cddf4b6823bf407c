#pragma once
// keep=: the tolerance of each level that leaves the share of triangles asked for, found on sample blocks before the build.
#include <atomic>

#include "cordillera.pb.h"
#include "pipeline/build/builder.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// Share of the finest grid's triangles asked for at `levels_up` above the finest level; beyond the list the last ratio is
/// repeated.
double kept_share(const proto::BuildOptions& options, int levels_up);

/// What the search costs, for who estimates it: of a dataset of more than kWholeTiles so many finest tiles are built so often, of
/// others all of them kPilotRunsOfWhole times.
inline constexpr std::size_t kPilotTiles = 64;
inline constexpr std::size_t kWholeTiles = 24;
inline constexpr double kPilotRuns = 3, kPilotRunsOfWhole = 5;

/// Sets the targets of all levels of plan (and what derives from them) by building a few blocks, spread over the data, again and
/// again. The whole dataset is the sample when it is small. Deterministic: a function of source and plan alone. builder makes the
/// sample, with all that it has; it is left with plan.
proto::Result<void> run_pilot(Builder& builder, proto::Plan& plan, const std::atomic<bool>& stop);

}  // namespace cordillera::pipeline
