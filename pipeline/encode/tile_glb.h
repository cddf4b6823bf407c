#pragma once
// The .glb of a tile of which only the .drc is stored: the one place where stores, servers, exports and checks get it from. And
// what both encodings of a tile are made of.
#include <string>
#include <string_view>

#include "cordillera.pb.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// What plan and options add to a tile's place, mesh and error: steps, skirts, words. published: of its mesh, not empty.
void take_from_plan(EncodeInput& input, const PublishedMesh& published, const proto::LevelPlan& level,
                    const proto::BuildOptions& options);

/// A pure function: the same plan, record and .drc give the same bytes on any machine. Its corners are those that the .drc
/// decodes to, rounded to the level's steps. "tile-damaged" where the .drc is not the tile that record and plan tell of.
proto::Result<std::string> tile_glb(const proto::Plan& plan, const proto::TileRecord& record, std::string_view drc,
                                    const Shading& shading = {});

}  // namespace cordillera::pipeline
