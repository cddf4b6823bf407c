#pragma once
// A dataset of made terrain, and its .glb tiles as a client of glTF reads them, with decoders that are not ours.
#include <gtest/gtest.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::testing {

using proto::TileAddress;
using proto::Vec3;

inline proto::Lattice lattice_of(int finest) {
  proto::Lattice lattice;
  lattice.finest_level = finest;
  return lattice;
}

/// A published dataset of tiles between two of the finest level, and whatever is above them.
class Dataset {
 public:
  /// coarse: heights of all levels but the finest.
  Dataset(int finest, const std::vector<std::pair<TileAddress, TileAddress>>& parts, const Heights& fine, const Heights& coarse)
      : lattice_(lattice_of(finest)) {
    auto writer = StoreWriter::open(folder_ / "a.sqlite", synthetic_plan(finest));
    EXPECT_TRUE(writer.ok());
    for (const auto& [first, last] : parts) {
      for (FinishedTask& task : synthetic_tasks(lattice_, first, last, fine)) {
        task.tiles.clear();
        if (auto tile = synthetic_tile(lattice_, task.node, task.node.z == finest ? fine : coarse))
          task.tiles.push_back(std::move(*tile));
        for (EncodedTile& tile : task.tiles) tile.glb.clear();
        EXPECT_TRUE((*writer)->commit(task).ok());
      }
    }
    EXPECT_TRUE((*writer)->publish(synthetic_manifest()).ok());
    store_ = StoreReader::open(folder_ / "a.sqlite").value();
    terrain_ = std::make_unique<faces::Terrain>(store_);
  }
  Dataset(int finest, const TileAddress& first, const TileAddress& last, const Heights& heights)
      : Dataset(finest, {{first, last}}, heights, heights) {}

  const faces::Terrain& terrain() const { return *terrain_; }
  /// The same tiles, that look otherwise.
  faces::Terrain terrain(faces::Look look) const { return faces::Terrain(store_, std::move(look)); }
  const proto::Lattice& lattice() const { return lattice_; }

 private:
  TemporaryFolder folder_;
  proto::Lattice lattice_;
  std::shared_ptr<const StoreReader> store_;
  std::unique_ptr<faces::Terrain> terrain_;
};

inline Vec3 unit(const Vec3& v) { return (1 / std::sqrt(dot(v, v))) * v; }
inline double degrees_between(const Vec3& a, const Vec3& b) {
  return std::acos(std::min(dot(unit(a), unit(b)), 1.0)) * 180 / M_PI;
}
inline Vec3 z_up(const std::array<float, 3>& p) { return {p[0], -p[2], p[1]}; }

inline std::string bytes_of(const faces::Terrain& terrain, const std::string& path, std::string_view normals) {
  auto found = faces::find(path);
  EXPECT_TRUE(found) << path;
  found->place.normals = normals;
  const auto document = found->resource->make(terrain, found->place);
  EXPECT_TRUE(document.ok() && *document) << path;
  return (*document)->bytes;
}
inline std::string path_of(const TileAddress& tile) {
  return "tiles/" + std::to_string(tile.z) + "/" + std::to_string(tile.x) + "/" + std::to_string(tile.y) + ".glb";
}

/// A picture of a tile, by the rules of glTF alone.
class Picture {
 public:
  Picture() = default;
  explicit Picture(std::string_view webp) {
    std::uint8_t* const rgb = WebPDecodeRGB(reinterpret_cast<const std::uint8_t*>(webp.data()), webp.size(), &width, &height);
    bytes.assign(rgb, rgb + std::ptrdiff_t{3} * width * height);
    WebPFree(rgb);
  }
  std::array<int, 3> pixel(int row, int column) const {
    const auto within = [](int limit, int k) { return std::clamp(k, 0, limit - 1); };
    const auto at = 3 * static_cast<std::size_t>(within(height, row) * width + within(width, column));
    return {bytes[at], bytes[at + 1], bytes[at + 2]};
  }
  /// Between pixels; v runs downward.
  Vec3 sampled(const std::array<float, 2>& texcoord) const {
    const double x = (offset[0] + scale[0] * texcoord[0]) * width - 0.5, y = (offset[1] + scale[1] * texcoord[1]) * height - 0.5;
    const double fx = x - std::floor(x), fy = y - std::floor(y);
    const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
    const auto at = [&](int r, int c) {
      const auto [red, green, blue] = pixel(r, c);
      return Vec3{static_cast<double>(red), static_cast<double>(green), static_cast<double>(blue)};
    };
    return (1 - fy) * ((1 - fx) * at(row, column) + fx * at(row, column + 1)) +
           fy * ((1 - fx) * at(row + 1, column) + fx * at(row + 1, column + 1));
  }

  int width = 0, height = 0;
  std::array<double, 2> offset = {0, 0}, scale = {1, 1};  ///< KHR_texture_transform
  std::vector<std::uint8_t> bytes;
};

/// A tile of glTF, by the rules of glTF alone.
class Gltf {
 public:
  explicit Gltf(const std::string& bytes) : bytes_(bytes) {
    const auto chunks = unpack_glb(bytes_).value();
    json = Json::parse(chunks.first);
    binary_ = chunks.second;
    for (const Json& primitive : json["meshes"][0]["primitives"]) {
      surfaces.push_back(draco_decode_lit(view(primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"])).value());
    }
    const Json& material = json["materials"][0];
    if (material.contains("normalTexture")) normal_map = picture(material["normalTexture"]);
    const Json& colours = material["pbrMetallicRoughness"];
    if (colours.contains("baseColorTexture")) photo = picture(colours["baseColorTexture"]);
  }

  /// As the specification has it: sampled between pixels, v downward, green along cross(normal, tangent) * w.
  Vec3 lit(const LitSurface& surface, std::size_t v) const {
    const Vec3 bytes = normal_map.sampled(surface.texcoords[v]), sample = (1 / 127.5) * bytes - Vec3{1, 1, 1};
    const auto& [x, y, z, w] = surface.tangents[v];
    const Vec3 normal = z_up(surface.normals[v]), tangent = z_up({x, y, z}), bitangent = w * cross(normal, tangent);
    return unit(sample.x * tangent + sample.y * bitangent + sample.z * normal);
  }

  Json json;
  std::vector<LitSurface> surfaces;  ///< by primitive
  Picture normal_map, photo;         ///< without pixels where there is none

 private:
  Picture picture(const Json& texture) const {
    const Json& source = json["textures"][texture["index"].get<std::size_t>()]["extensions"]["EXT_texture_webp"]["source"];
    Picture out(view(json["images"][source.get<std::size_t>()]["bufferView"]));
    if (!texture.contains("extensions")) return out;
    const Json& transform = texture["extensions"]["KHR_texture_transform"];
    out.offset = transform["offset"].get<std::array<double, 2>>();
    out.scale = transform["scale"].get<std::array<double, 2>>();
    return out;
  }
  std::string_view view(const Json& index) const {
    const Json& v = json["bufferViews"][index.get<std::size_t>()];
    return binary_.substr(v["byteOffset"].get<std::size_t>(), v["byteLength"].get<std::size_t>());
  }
  std::string bytes_;
  std::string_view binary_;
};

}  // namespace cordillera::pipeline::testing
