#include "pipeline/faces/quantized_mesh/terrain_tileset_glb.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/little_endian.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr int kFloat = 5126, kShort = 5123, kInt = 5125, kVertices = 34962, kIndices = 34963;

using Float3 = std::array<float, 3>;

/// glTF's y is up: x, z, -y.
Float3 y_up(const proto::Vec3& v) { return {static_cast<float>(v.x), static_cast<float>(v.z), static_cast<float>(-v.y)}; }

/// Bytes of the buffer and the JSON that says what they are.
struct GlbBuffer {
  std::string bytes;
  Json views = Json::array(), accessors = Json::array();

  std::size_t add(const std::vector<Float3>& vectors) {
    Float3 low = vectors[0], high = low;
    const std::size_t start = bytes.size();
    for (const Float3& v : vectors) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], v[k]);
        high[k] = std::max(high[k], v[k]);
        append_little_endian(bytes, std::bit_cast<std::uint32_t>(v[k]));
      }
    }
    view(start, kVertices);
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", kFloat},
                         {"count", vectors.size()},
                         {"type", "VEC3"},
                         {"min", low},
                         {"max", high}});
    return accessors.size() - 1;
  }

  template <class Indices>
  std::size_t add_indices(const Indices& indices, bool wide, int target) {
    const std::size_t start = bytes.size();
    for (const std::uint32_t index : indices) {
      if (wide) {
        append_little_endian(bytes, index);
      } else
        append_little_endian(bytes, static_cast<std::uint16_t>(index));
    }
    view(start, target);
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", wide ? kInt : kShort},
                         {"count", indices.size()},
                         {"type", "SCALAR"}});
    return accessors.size() - 1;
  }

 private:
  void view(std::size_t start, int target) {
    views.push_back({{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes.size() - start}});
    if (target != 0) views.back()["target"] = target;
    pad(bytes, 4, '\0');
  }
};

Json primitive_of(const QuantizedSurface& surface, const std::vector<proto::Vec3>& at, const proto::Vec3& centre,
                  GlbBuffer& buffer) {
  std::vector<Float3> positions, normals;
  for (std::size_t v = 0; v < at.size(); ++v) {
    positions.push_back(y_up(at[v] - centre));
    normals.push_back(y_up(surface.vertices[v].normal));
  }
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : surface.triangles) corners.insert(corners.end(), t.begin(), t.end());
  const bool wide = at.size() > 65534;
  Json out;
  out["attributes"] = {{"POSITION", buffer.add(positions)}, {"NORMAL", buffer.add(normals)}};
  out["indices"] = buffer.add_indices(corners, wide, kIndices);
  out["material"] = 0;
  Json edges;
  constexpr std::array<const char*, 4> kNames = {"left", "bottom", "right", "top"};
  for (std::size_t side = 0; side < 4; ++side) edges[kNames[side]] = buffer.add_indices(surface.sides[side], wide, 0);
  out["extensions"] = {{"CESIUM_tile_edges", edges}};
  return out;
}

}  // namespace

std::string terrain_glb(const QuantizedSurface& surface, const std::string& copyright) {
  std::vector<proto::Vec3> at = positions(surface);
  // A library's last bit is not to be seen in the bytes.
  for (proto::Vec3& p : at) {
    for (double proto::Vec3::*axis : {&proto::Vec3::x, &proto::Vec3::y, &proto::Vec3::z}) {
      p.*axis = std::nearbyint(std::ldexp(p.*axis, 12)) / 4096;
    }
  }
  const proto::Vec3 centre = quantized_bounds(surface, at).centre;
  GlbBuffer buffer;
  const Json primitive = primitive_of(surface, at, centre, buffer);
  Json out;
  out["asset"] = {{"version", "2.0"}, {"generator", "Cordillera"}};
  if (!copyright.empty()) out["asset"]["copyright"] = copyright;
  out["extensionsUsed"] = Json::array({"CESIUM_tile_edges"});
  out["scene"] = 0;
  out["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  out["nodes"] = Json::array(
      {{{"mesh", 0}, {"matrix", Json::array({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, centre.x, centre.z, -centre.y, 1})}}});
  out["meshes"] = Json::array({{{"primitives", Json::array({primitive})}}});
  out["materials"] = Json::array({{{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}});
  out["accessors"] = buffer.accessors;
  out["bufferViews"] = buffer.views;
  out["buffers"] = Json::array({{{"byteLength", buffer.bytes.size()}}});
  return pack_glb(out.dump(-1, ' ', false, Json::error_handler_t::replace), buffer.bytes);
}

}  // namespace cordillera::pipeline::faces
