// The table: a face is reachable, exported and described because it stands here.
#include <array>

#include "pipeline/contours/contours.h"
#include "pipeline/faces/draco_tiles.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/mercator/mercator_draco.h"
#include "pipeline/faces/mercator/mercator_terrain.h"
#include "pipeline/faces/pictures/height_pictures.h"
#include "pipeline/faces/pictures/hillshade.h"
#include "pipeline/faces/pictures/styles.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh.h"
#include "pipeline/faces/quantized_mesh/terrain_tileset.h"
#include "pipeline/faces/tiles_3d/tileset_3d.h"
#include "pipeline/faces/tiles_3d/tileset_explicit.h"

namespace cordillera::pipeline::faces {

std::span<const Face* const> all_faces() {
  static const auto kAll = std::to_array<const Face*>({&draco_tiles(), &tileset_3d(), &tileset_explicit(), &quantized_mesh(),
                                                       &terrain_tileset(), &terrain_rgb(), &terrain_rgb_webp(), &terrarium(),
                                                       &terrarium_webp(), &hillshade(), &relief(), &color_relief(), &slope(),
                                                       &aspect(), &contours::contours(), &mercator_draco(), &mercator_terrain()});
  return kAll;
}

}  // namespace cordillera::pipeline::faces
