#pragma once
// Directories of a PMTiles archive, version 3: which run of tiles lies where. After github.com/protomaps/PMTiles, spec/v3.
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace cordillera::pipeline::exports {

/// A run of tiles with the same bytes; in a root directory with run 0: a leaf directory that begins with this id.
struct PmtilesEntry {
  std::uint64_t id = 0;
  std::uint64_t offset = 0;  ///< from the start of the tiles, or of the leaf directories
  std::uint32_t length = 0;
  std::uint32_t run = 1;
};

/// Adds a tile to entries that are in the order of ids; a tile that goes on where the last one ends, with its bytes, makes it
/// longer.
void append(std::vector<PmtilesEntry>& entries, const PmtilesEntry& tile);

struct PmtilesDirectories {
  std::string root;    ///< at most kMostRootBytes
  std::string leaves;  ///< one after the other; empty where the root holds all tiles
};
/// Header and root directory are what a reader fetches first: the first 16 KiB.
inline constexpr std::size_t kPmtilesHeader = 127, kMostRootBytes = 16384 - kPmtilesHeader;

/// Compressed with gzip.
PmtilesDirectories pmtiles_directories(std::span<const PmtilesEntry> entries);

}  // namespace cordillera::pipeline::exports
