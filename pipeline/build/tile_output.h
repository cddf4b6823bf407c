#pragma once
// From a finished mesh to what the store keeps of it.
#include <cstdint>
#include <optional>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/mesh/mesh_point.h"
#include "pipeline/store/store.h"
#include "pipeline/tile/tile_mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// nullopt: the tile publishes no triangle. options: of the plan; what its tiles are to carry.
std::optional<EncodedTile> encode_tile(const LevelContext& context, const BuiltTile& built, const proto::BuildOptions& options);

/// A tile of the finest level, as far as it can be finished before its sides are agreed upon with its neighbours.
struct FinishedFinest {
  std::optional<EncodedTile> tile;       ///< nullopt: it publishes no triangle
  std::vector<gpu::MeshPoint> on_sides;  ///< see MetPixels
  double above_m = 0;                    ///< by how much it is above its target, where it was measured
};
/// Whether what was measured of a tile before is taken where nothing went into it.
enum class Measure : std::uint8_t { always, changed };

/// Lets the tile meet pixels where the plan asks for it, measures and encodes it, and notes how far it is from its pixels.
FinishedFinest finish_finest(const proto::Plan& plan, const LevelContext& context, BuiltTile& built,
                             const std::vector<raster::PixelPoint>& pixels, Measure measure);

}  // namespace cordillera::pipeline
