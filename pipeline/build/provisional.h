#pragma once
// Provisional tiles: the coarse levels of a dataset, made of few of its pixels while its build is still to come. They have the
// addresses of the final ones; how far they are off nobody has measured.
#include <cstdint>
#include <optional>

#include "pipeline/build/build.h"

namespace cordillera::pipeline {

/// A build, in the ordinary way, of the finest level at which the raster has at most `most_samples` on the lattice and of all
/// above it. Its store is another than the request's, for the caller to name. source: of the request; of several rasters each is
/// opened here, once. Nothing: the request is for more than kMostLookedAt rasters, for so small a part (bbox) of one that too
/// much would be read in vain, for no such level, or is itself no more than kWorthwhile times as much work. Problems: those of
/// plan_of, and of reading the pixels.
proto::Result<std::optional<BuildRequest>> provisional_request(const BuildRequest& request, raster::Source& source,
                                                               std::int64_t most_samples);

/// The finest level of that build; nothing where there is none. Reads no pixel.
proto::Result<std::optional<int>> provisional_level(const BuildRequest& request, const raster::Source& source,
                                                    std::int64_t most_samples);

/// How many samples the raster has at the level of the build's blocks: with so many, tiles of blocks can take their places one by
/// one, if has_blocks_to_show().
struct BlockLevel {
  int level = 0;
  std::int64_t samples = 0;
  bool has_blocks_to_show = false;
};
/// Reads no pixel.
proto::Result<BlockLevel> block_level_of(const BuildRequest& request, raster::Source& source);

/// Rasters that are opened for a first picture.
inline constexpr std::size_t kMostLookedAt = 2000;

/// Whether what it builds is provisional.
bool is_provisional(const BuildRequest& request);

/// How many times the work of its provisional tiles a build must be.
inline constexpr std::int64_t kWorthwhile = 8;

}  // namespace cordillera::pipeline
