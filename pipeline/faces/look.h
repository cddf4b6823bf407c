#pragma once
// What tiles look like where whoever asks for one says nothing else.
#include <memory>

#include "pipeline/encode/encode.h"
#include "proto/lattice.h"

namespace cordillera::raster {
class Orthophoto;
}

namespace cordillera::pipeline::faces {

/// Of Look::photo_quality: every pixel is kept.
inline constexpr int kLossless = 100;

struct Look {
  Normals normals = Normals::vertex;            ///< of .glb tiles, as the photo
  std::shared_ptr<raster::Orthophoto> photo{};  ///< the colours of the ground; null: one for all
  int photo_finer = 0;                          ///< a cell of a tile's level is cut in two so often, per axis, for its photo
  int photo_quality = kLossless;                ///< libwebp's, from 1 on
  std::int32_t interval_mm = 0;                 ///< of contours, as if ?interval= asked for it; 0: each zoom's own

  std::int32_t photo_side() const { return (proto::kTileCells << photo_finer) + 1; }  ///< pixels
};

}  // namespace cordillera::pipeline::faces
