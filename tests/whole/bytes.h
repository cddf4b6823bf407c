#pragma once
// Everything a client can fetch of a store's tiles, to be compared with that of another.
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "proto/lattice.h"

namespace cordillera::whole {

/// By tile; 0: .drc, 1: .glb, 2: what is stated of it, 3: its water mask.
using Bytes = std::map<std::pair<proto::TileAddress, int>, std::string>;

/// Of a published store; a failed test and nothing when it is none.
Bytes published(const std::string& path);

/// Tiles that are not all land.
std::size_t masks_in(const Bytes& bytes);

/// The same tiles with the same bytes, and some tens of them.
void expect_same(const Bytes& a, const Bytes& b);

}  // namespace cordillera::whole
