// The table: a face is reachable, exported and described because it stands here.
#include <array>

#include "pipeline/faces/draco_tiles.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/tileset_3d.h"

namespace cordillera::pipeline::faces {

std::span<const Face* const> all_faces() {
  static const std::array<const Face*, 2> kAll = {&draco_tiles(), &tileset_3d()};
  return kAll;
}

}  // namespace cordillera::pipeline::faces
