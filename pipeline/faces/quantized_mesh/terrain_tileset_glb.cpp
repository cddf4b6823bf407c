#include "pipeline/faces/quantized_mesh/terrain_tileset_glb.h"

#include <cmath>

#include "pipeline/encode/glb.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"

namespace cordillera::pipeline::faces {
namespace {

Json primitive_of(const QuantizedSurface& surface, const std::vector<proto::Vec3>& at, const proto::Vec3& centre,
                  GlbBuffer& buffer) {
  std::vector<GltfVector> positions, normals;
  for (std::size_t v = 0; v < at.size(); ++v) {
    positions.push_back(y_up(at[v] - centre));
    normals.push_back(y_up(surface.vertices[v].normal));
  }
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : surface.triangles) corners.insert(corners.end(), t.begin(), t.end());
  const int type = index_type(at.size());
  Json out;
  Json attributes;
  attributes["POSITION"] = buffer.add_vectors(positions);
  buffer.add_bounds(positions);
  attributes["NORMAL"] = buffer.add_vectors(normals);
  buffer.add_bounds(normals);
  out["attributes"] = std::move(attributes);
  out["indices"] = buffer.add_indices(corners, type, kGltfIndices);
  out["material"] = 0;
  Json edges;
  constexpr std::array<const char*, 4> kNames = {"left", "bottom", "right", "top"};
  for (std::size_t side = 0; side < 4; ++side) edges[kNames[side]] = buffer.add_indices(surface.sides[side], type, 0);
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
