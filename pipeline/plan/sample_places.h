#pragma once
// A few nodes of a tree that stand for all: where a dry run builds.
#include <vector>

#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Nodes of a level, or of the finest one above it that has no more than a quarter of a million, that the source does not know to
/// be empty; in the order of a Z curve: neighbours in the list are neighbours on the ground. Asks from the blocks downwards, so
/// that a sparse raster costs what it holds, and asks no more than a few thousand times.
std::vector<proto::TileAddress> filled_nodes(const proto::Plan& plan, const raster::Source& source, int level);

/// How many nodes of another level lie above or below the nodes.
std::size_t count_at(std::vector<proto::TileAddress> nodes, int level);

/// Of the nodes' descendants at a level that is no coarser, the one at a place along the curve.
proto::TileAddress node_at(const std::vector<proto::TileAddress>& nodes, std::size_t place, int level);

/// At most how many tiles of a level the plan's window touches.
double touched_count(const proto::Plan& plan, int level);

/// The k-th of count places, for k = 0, 1, 2, …: each new one falls into a large gap between those before (steps of the golden
/// ratio), so any number of them is spread evenly.
std::size_t spread_place(std::size_t k, std::size_t count);

/// The finest samples of up to kMostSamplePlaces tiles of the finest level, spread evenly. Those that cannot be read are left
/// out, for the build to tell. Needs levels and window of the plan only, and a block level that level_of_places() gives.
std::vector<proto::Samples> sample_places(const proto::Plan& plan, raster::Source& source);
inline constexpr std::size_t kMostSamplePlaces = 16;

}  // namespace cordillera::pipeline
