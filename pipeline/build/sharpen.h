#pragma once
// A provisional dataset that becomes sharper while its build runs: blocks that are done have their final tiles in it.
#include <set>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// Whether there are several blocks.
bool has_blocks_to_show(const proto::Plan& plan);

/// Whether final tiles of the plan's blocks can stand in a provisional dataset: there are some to show, and it reaches down to
/// their level, so that every tile has either all of its children or none.
bool can_show_blocks(const proto::Plan& plan, const proto::Manifest& provisional);

/// Blocks of which a provisional dataset has the final tiles.
std::set<proto::TileAddress> blocks_in(const proto::Manifest& provisional);

/// Writes the provisional dataset of one store into another, with the tiles of done blocks in place of its own. Tiles are on the
/// plan's lattice then. done: of blocks alone. Their errors are not stated, as those of all provisional tiles.
proto::Result<void> put_done_blocks(const std::string& store, const proto::Plan& plan, const std::vector<FinishedTask>& done,
                                    const std::string& next);

/// Writes final tiles of the block's finest level into a store of their own, for who waits for them while the rest of the block
/// is made. shown: the store of the provisional dataset.
proto::Result<void> put_finest(const std::string& shown, const proto::Plan& plan, FinishedTask finest, const std::string& store);

}  // namespace cordillera::pipeline
