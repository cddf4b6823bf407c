#pragma once
// What is stated of a tile above exact blocks: a bound, for no sample is at hand, and what is measured where a bound is not
// enough.
#include <cstdint>
#include <vector>

#include "gpu/measure/surface_error.h"
#include "gpu/simplify.h"
#include "pipeline/build/exact/ground_meter.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// Metres a metre: what rounding adds to a bound on such a slope is set aside, see levels_above.
inline constexpr double kMildSlope = 3;

/// States a tile's error: what the engine knows of it (max_error_m, as tiles_of_block has it), and what rounding may add. Steep
/// triangles, needles and what lies beside a pole are measured as they will be decoded; where they are too far off, or upside
/// down in space, edges are turned and vertices put back. Borrows what it is given. A coarse tile has few others beside it, so
/// its own pieces go to several threads.
class ErrorStatement {
 public:
  /// rmse_step: between the samples that the RMSE looks at; 0: by what the tile shows.
  ErrorStatement(const LevelContext& context, const KnownGround& known, BuiltTile& tile, int rmse_step = 0);
  std::size_t pieces() const;  ///< of steep triangles
  void measure(std::size_t piece);
  void put_back();            ///< after all pieces
  std::size_t bands() const;  ///< of the samples that the RMSE looks at, after put_back()
  void measure_band(std::size_t band);
  void finish();  ///< after all bands

 private:
  const LevelContext& context_;
  BuiltTile& tile_;
  const GroundMeter known_;
  std::vector<std::uint32_t> steep_;
  std::vector<double> error_m_;           ///< indexed as steep_
  int step_;                              ///< between samples that the RMSE looks at, once it is known
  std::vector<gpu::SurfaceError> bands_;  ///< sums of squares
};

/// Of all tiles of a level that lie on a ground.
void state_errors(const LevelContext& context, const KnownGround& known, const gpu::ParallelFor& parallel,
                  std::vector<BuiltTile>& tiles, int rmse_step = 0);

}  // namespace cordillera::pipeline
