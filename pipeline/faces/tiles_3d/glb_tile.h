#pragma once
// What ?normals= asks of 3D Tiles, and the .glb that answers it.
#include <optional>
#include <string_view>

#include "pipeline/encode/encode.h"
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// What ?normals= accepts, for the API's description and for refusals.
inline constexpr std::string_view kNormals =
    "vertex (a normal a vertex; the default), texture (a normal map of the finer surface), none";

/// A problem where the text is none of them; empty: the default.
proto::Result<Normals> normals_named(std::string_view text);

/// The end of a link to tiles with these normals: "?normals=texture"; nothing for the default.
proto::Result<std::string_view> normals_query(std::string_view text);

/// A tile with these normals and the terrain's photo; empty: the terrain's own normals. What is not in the store is made, and
/// kept with the terrain's documents.
proto::Result<std::optional<Document>> glb_tile(const Terrain& terrain, const proto::TileAddress& tile, std::string_view normals);
/// Its tag; nothing where the normals are none that there are.
std::optional<std::string> glb_tag(const Terrain& terrain, const proto::TileAddress& tile, std::string_view normals);

}  // namespace cordillera::pipeline::faces
