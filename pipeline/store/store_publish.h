#pragma once
// The last step of a store: nodes, sums and bounds of all tiles. Runs inside the caller's transaction.
#include "cordillera.pb.h"
#include "pipeline/store/sqlite.h"

namespace cordillera::pipeline {

/// Fills the nodes table. Levels finest .. 0.
void make_nodes(Database& database, int finest_level);

/// Thrown by summarise when no tile has a triangle.
class NothingToPublish : public StoreError {
 public:
  NothingToPublish() : StoreError("no tile has a triangle") {}
};

/// Says of each source whose heights are taken for others than it declares which they are, once for all alike, and what was noted
/// of it when it was opened: who reads the notes alone is told, too.
void note_datums(proto::Manifest& manifest);

/// Fills levels, tiles, triangles, bytes, bounds, and what the store's format itself says (levels, height step, formula).
void summarise(Database& database, const proto::Plan& plan, proto::Manifest& manifest);

}  // namespace cordillera::pipeline
