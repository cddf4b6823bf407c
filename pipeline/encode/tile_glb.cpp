#include "pipeline/encode/tile_glb.h"

#include <stdexcept>
#include <utility>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/skirt_depth.h"
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {
namespace {

proto::Problem no_glb(const std::string& why) {
  return {"tile-damaged", "no .glb can be made of the tile: " + why, "a tile of a sound store", ""};
}

}  // namespace

void take_from_plan(EncodeInput& input, const PublishedMesh& published, const proto::LevelPlan& level,
                    const proto::BuildOptions& options) {
  input.ecef_steps = ecef_steps(level);
  input.height_step = height_step(level);
  input.skirts = skirts_of(input, published, level, static_cast<int>(options.min_level()));
  input.title = options.title();
  input.attribution = options.attribution();
}

proto::Result<std::string> tile_glb(const proto::Plan& plan, const proto::TileRecord& record, std::string_view drc,
                                    const Shading& shading) {
  const proto::LevelPlan* const level = find_level(plan, static_cast<int>(record.level()));
  if (level == nullptr) return no_glb("the plan has no level " + std::to_string(record.level()));
  auto decoded = draco_decode_lattice(drc);
  if (!decoded) return decoded.problem();
  const proto::Lattice lattice{static_cast<int>(plan.finest_level())};
  const proto::TileAddress tile{static_cast<int>(record.level()), static_cast<std::int32_t>(record.x()),
                                static_cast<std::int32_t>(record.y())};
  if (proto::TileAddress{decoded->z, decoded->x, decoded->y} != tile || decoded->side != lattice.tile_units(tile.z))
    return no_glb("its .drc is another tile's");
  const proto::TileMesh mesh = tile_mesh_of(in_mesh_steps(std::move(*decoded)));
  const PublishedMesh published = published_mesh(mesh);
  if (published.empty()) return no_glb("its .drc has no triangle");
  EncodeInput input;
  input.lattice = &lattice, input.tile = tile, input.mesh = &mesh;
  input.geometric_error_m = record.max_error();
  take_from_plan(input, published, *level, plan.options());
  input.shading = shading;
  try {
    return encode_glb(input, published);
  } catch (const std::invalid_argument& failed) { return no_glb(failed.what()); }
}

}  // namespace cordillera::pipeline
