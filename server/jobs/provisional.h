#pragma once
// Tiles of a dataset that is still being built: how an answer that holds them is told from a final one.
#include <optional>

#include "pipeline/faces/terrain.h"
#include "server/http/json.h"
#include "server/http/message.h"

namespace cordillera::server {

inline constexpr const char* kProvisionalHeader = "Cordillera-Provisional";

/// Marks an answer that no client and no cache is to keep or to revalidate: the final one is another document.
void mark_provisional(Response& response);

/// The data of an event "tiles": {"provisional", "levels": [{"level", "x": [first, last], "y": [first, last]}], "bounds",
/// "tiles"}: the addresses at which something else is found than before, and how many tiles there are now. Rows count from the
/// south.
Json tiles_json(const proto::Manifest& manifest);

/// Columns and rows of a level that bounds touch.
struct TouchedTiles {
  std::int32_t west = 0, south = 0, east = 0, north = 0;
};
/// None: the manifest has no bounds.
std::optional<TouchedTiles> touched_by_bounds(const proto::Manifest& manifest, int level);

/// Whether the tile has its final bytes: its block is done.
bool is_in_done_block(const proto::Manifest& shown, const proto::TileAddress& tile);
/// Whether a look at the tile changes anything: not above all blocks, beside them, nor where they are done.
bool waits_for_block(const proto::Manifest& shown, const proto::TileAddress& tile);

}  // namespace cordillera::server
