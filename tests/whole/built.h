#pragma once
// The whole way, run once: raster file -> published store -> every tile as a client decodes it, beside the samples it stands for.
#include <map>
#include <optional>
#include <string>

#include "cordillera.pb.h"
#include "pipeline/store/store.h"
#include "proto/mesh.h"
#include "tests/whole/dem.h"
#include "tests/whole/evaluator.h"

namespace cordillera::whole {

/// A tile both ways, and what is stated of it.
struct BuiltTile {
  DecodedTile drc;
  DecodedSurface glb;
  proto::TileRecord record;
};
using Level = std::map<proto::TileAddress, BuiltTile>;

struct Built {
  proto::Manifest manifest;
  proto::Plan plan;  ///< as it was built: tolerances of the manifest, steps and rims derived from them
  proto::Lattice lattice;
  std::map<int, Level> levels;  ///< decoded; levels without tiles are there, empty
  proto::Samples samples;       ///< the finest lattice inside the plan's window

  /// Height at a finest lattice vertex, i modulo the circle; none where there is no data.
  std::optional<double> truth(std::int64_t i, std::int64_t j) const;
  const Level& finest() const { return levels.at(lattice.finest_level); }
  std::size_t triangles(int level) const;
  double stated_m(int level) const;  ///< greatest stated error of the level's tiles
};

/// Options of most tests: heights are ellipsoidal, so that what goes in comes out; two threads.
proto::BuildOptions plain_options();
proto::BuildOptions with_error(double error_m);
/// The same with strategy=exact.
proto::BuildOptions exact(double error_m);

/// Builds, publishes and decodes. Throws std::runtime_error with the problem's line when any of it fails. block_samples,
/// quarter_side: see BuildRequest.
Built build_file(const std::string& path, const proto::BuildOptions& options, std::int64_t block_samples = 0,
                 std::int32_t quarter_side = 0);
/// max_level is the raster's own level, where it has one.
Built build_dem(const Dem& dem, proto::BuildOptions options, std::int64_t block_samples = 0, std::int32_t quarter_side = 0);

/// |decoded - expected| at a place of the finest lattice on a level's .drc tiles, in metres; none where there is no triangle.
std::optional<double> error_at(const Built& built, int level, std::int64_t i, std::int64_t j, double expected_m);

/// Whether a triangle of the tile covers the finest lattice vertex (i, j) in plan, its edges included.
bool covered(const BuiltTile& tile, const proto::Lattice& lattice, std::int64_t i, std::int64_t j);
/// The same for any tile of a level.
bool covered(const Built& built, int level, std::int64_t i, std::int64_t j);

}  // namespace cordillera::whole
