#pragma once
// From a finished mesh to what the store keeps of it.
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/mesh/mesh_point.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"
#include "pipeline/tile/tile_mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Finest samples with data, and the flat and the filled ones among them; of a tile's western and southern border only, so that
/// tiles add up. Their least and greatest height, kHeightStep_m: of all of them, for the samples of a border may be all that a
/// neighbour has, which then publishes nothing.
struct SampleCount {
  std::uint32_t valid = 0, flat = 0, filled = 0;
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
};

/// The samples of a block, counted once for the tiles of all its levels. Borrows the lattice.
class SampleCounts {
 public:
  SampleCounts(const proto::Lattice& lattice, const proto::Samples& samples, Workers& workers,
               Workers::Haste haste = Workers::Haste::none);
  SampleCount of(const proto::TileAddress& tile) const;

 private:
  const proto::Lattice& lattice_;
  const std::int64_t samples_west_, samples_east_;
  const std::int64_t west_, south_, across_;  ///< in tiles of the finest level
  std::vector<SampleCount> squares_;          ///< of these, by rows from the south-west
};

/// The record of a tile whose data is under no triangle.
EncodedTile lost_tile(const proto::TileAddress& tile, const SampleCount& count);

/// nullopt: the tile publishes no triangle. options: of the plan; what its tiles are to carry.
std::optional<EncodedTile> encode_tile(const LevelContext& context, const BuiltTile& built, const proto::BuildOptions& options);

/// Those that do, in order. stop: may be null; once true, the rest is left out.
std::vector<EncodedTile> encode_tiles(const LevelContext& context, const std::vector<BuiltTile>& built,
                                      const proto::BuildOptions& options, Workers& workers,
                                      const std::atomic<bool>* stop = nullptr);
/// Those that are there, in order.
std::vector<EncodedTile> without_gaps(std::vector<std::optional<EncodedTile>>& tiles);

/// A tile of the finest level, as far as it can be finished before its sides are agreed upon with its neighbours.
struct FinishedFinest {
  std::optional<EncodedTile> tile;       ///< nullopt: it publishes no triangle
  std::vector<gpu::MeshPoint> on_sides;  ///< see MetPixels
  double above_m = 0;                    ///< by how much it is above its target, where it was measured
};
/// Whether what was measured of a tile before is taken where nothing went into it.
enum class Measure : std::uint8_t { always, changed };

/// Lets the tile meet pixels where the plan asks for it, measures and encodes it, and notes how far it is from its pixels.
/// memory: of the tile at limit_of().
FinishedFinest finish_finest(const proto::Plan& plan, const LevelContext& context, BuiltTile& built,
                             const std::vector<raster::PixelPoint>& pixels, Measure measure, gpu::SurfaceMemory& memory);

}  // namespace cordillera::pipeline
