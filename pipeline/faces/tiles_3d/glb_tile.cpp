#include "pipeline/faces/tiles_3d/glb_tile.h"

#include <algorithm>
#include <string>
#include <utility>

#include "pipeline/faces/mesh_normals.h"
#include "pipeline/faces/pictures/webp_image.h"
#include "pipeline/faces/tiles_3d/normal_map.h"
#include "pipeline/faces/tiles_3d/photo_texture.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Problem refused(std::string_view text) {
  const bool printable = std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 127; });
  const std::string shown(printable ? text.substr(0, 80) : "(not plain text)");
  return {"option-invalid", "normals=" + shown + " names no normals that tiles can have", std::string(kNormals), "normals"};
}

/// While a dataset is being built, neighbours above its blocks may come and go.
bool knows_neighbours(const Terrain& terrain, const proto::TileAddress& tile) {
  return !terrain.manifest().provisional() || tile.z >= terrain.store().block_level();
}

/// Whether vertices have normals of their own and nothing else is on the tile.
bool is_plain(const Terrain& terrain, Normals normals) { return normals == Normals::vertex && !terrain.look().photo; }

proto::Result<std::optional<Blob>> made(const Terrain& terrain, const proto::TileAddress& tile, Normals normals) {
  const auto record = terrain.store().record(tile);
  if (!record) return std::optional<Blob>();  // a picture of nothing takes as long as any other
  if (is_plain(terrain, normals) && record->glb_bytes() > 0)
    return terrain.store().tile(tile, Encoding::glb);  // a store of format 1
  Shading shading{normals};
  std::string map;
  if (normals == Normals::texture) map = webp(normal_map(terrain, tile), kNormalMapSide);
  shading.picture = map;
  const auto photo = terrain.look().photo ? photo_texture(terrain, tile) : std::optional<std::string>();
  if (!photo.ok()) return photo.problem();
  if (*photo) shading.photo = **photo;
  const auto mesh = normals == Normals::vertex && knows_neighbours(terrain, tile) ? terrain.mesh(tile) : nullptr;
  const SideNormals sides = mesh ? side_normals(terrain, *mesh) : SideNormals();
  if (mesh) shading.sides = &sides;
  shading.photo_side = static_cast<std::uint32_t>(terrain.look().photo_side());
  return terrain.store().glb(tile, shading);
}

std::string name_of(const proto::TileAddress& tile, Normals normals) {
  std::string name = normals == Normals::texture ? "textured.glb" : normals == Normals::none ? "bare.glb" : "lit.glb";
  for (const std::int32_t number : {tile.z, tile.x, tile.y}) name.append("/").append(std::to_string(number));
  return name;
}

/// Whether the store's own tile is what is asked for.
bool is_stored(const Terrain& terrain, const proto::TileAddress& tile, Normals normals) {
  return is_plain(terrain, normals) && !knows_neighbours(terrain, tile);
}

/// What a tile is to have; a tileset that names none leaves it to the terrain.
proto::Result<Normals> of_tile(const Terrain& terrain, std::string_view text) {
  return text.empty() ? proto::Result<Normals>(terrain.look().normals) : normals_named(text);
}

}  // namespace

proto::Result<Normals> normals_named(std::string_view text) {
  if (text.empty() || text == "vertex") return Normals::vertex;
  if (text == "none") return Normals::none;
  if (text == "texture") return Normals::texture;
  return refused(text);
}

proto::Result<std::string_view> normals_query(std::string_view text) {
  const auto normals = normals_named(text);
  if (!normals) return normals.problem();
  return std::string_view(*normals == Normals::texture ? "?normals=texture" : *normals == Normals::none ? "?normals=none" : "");
}

proto::Result<std::optional<Document>> glb_tile(const Terrain& terrain, const proto::TileAddress& tile,
                                                std::string_view normals) {
  const auto named = of_tile(terrain, normals);
  if (!named) return named.problem();
  if (is_stored(terrain, tile, *named)) return terrain.tile(tile, Encoding::glb);
  return terrain.kept(name_of(tile, *named), [&]() -> proto::Result<std::optional<Document>> {
    auto blob = made(terrain, tile, *named);
    if (!blob.ok()) return blob.problem();
    if (!*blob) return std::optional<Document>();
    return std::optional(Document{std::move((*blob)->bytes), std::move((*blob)->etag)});
  });
}

std::optional<std::string> glb_tag(const Terrain& terrain, const proto::TileAddress& tile, std::string_view normals) {
  const auto named = of_tile(terrain, normals);
  if (!named) return std::nullopt;
  if (is_stored(terrain, tile, *named)) return terrain.tile_tag(tile, Encoding::glb);
  const auto document = glb_tile(terrain, tile, normals);
  return document.ok() && *document ? std::optional((*document)->etag) : std::nullopt;
}

}  // namespace cordillera::pipeline::faces
