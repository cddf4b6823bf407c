// One uncompressed primitive: every program that reads glTF reads it.
#include <algorithm>
#include <cmath>

#include "pipeline/encode/encode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/exports/whole_file.h"

namespace cordillera::pipeline::exports {
namespace {

using proto::Vec3;

/// Never -0: it would be seen in the bytes.
GltfVector placed(const Vec3& p) { return y_up({p.x, -(0 - p.y), p.z}); }

Vec3 vertex(const proto::TriangleMesh& mesh, std::uint32_t v) { return {mesh.x[v], mesh.y[v], mesh.z[v]}; }

/// Means of the triangles' normals by their areas, in the triangles' order.
std::vector<Vec3> normals_of(const proto::TriangleMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices());
  for (const auto& t : mesh.triangles) {
    const Vec3 a = vertex(mesh, t[0]);
    const Vec3 across = cross(vertex(mesh, t[1]) - a, vertex(mesh, t[2]) - a);
    for (const std::uint32_t v : t) normals[v] = normals[v] + across;
  }
  for (Vec3& n : normals) {
    const double length = std::sqrt(dot(n, n));
    n = length > 0 ? (1 / length) * n : Vec3{0, 0, 1};
  }
  return normals;
}

/// Positions, normals, indices.
GlbBuffer buffer_of(const ExtractedMesh& mesh, const Vec3& translation) {
  const proto::TriangleMesh& all = mesh.mesh;
  GlbBuffer out;
  out.bytes.reserve(24 * all.vertices() + 12 * all.triangles.size());
  std::vector<GltfVector> vectors;
  vectors.reserve(all.vertices());
  for (std::uint32_t v = 0; v < all.vertices(); ++v) vectors.push_back(placed(vertex(all, v) - translation));
  out.add_vectors(vectors);
  out.add_bounds(vectors);
  vectors.clear();
  for (const Vec3& n : normals_of(all)) vectors.push_back(placed(n));
  out.add_vectors(vectors);
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * all.triangles.size());
  for (const auto& t : all.triangles) corners.insert(corners.end(), t.begin(), t.end());
  out.add_indices(corners, kGltfUnsignedInt, kGltfIndices);
  return out;
}

/// What float32 would spoil counts from there; whole metres, or units of a map.
Vec3 translation_of(const ExtractedMesh& mesh) {
  if (mesh.frame == MeshFrame::ecef) return mesh.origin_m;
  if (mesh.frame != MeshFrame::map) return {};
  const auto middle = [](const std::vector<double>& axis) {
    const auto [low, high] = std::ranges::minmax(axis);
    return std::round((low + high) / 2);
  };
  return {middle(mesh.mesh.x), middle(mesh.mesh.y), 0};
}

std::string json_of(const ExtractedMesh& mesh, const proto::Manifest& manifest, const GlbBuffer& buffer,
                    const Vec3& translation) {
  Json root;
  root["asset"] = {{"version", "2.0"}, {"generator", "Cordillera"}};
  if (!manifest.attribution().empty()) root["asset"]["copyright"] = manifest.attribution();
  root["asset"]["extras"] = {{"title", title_of(manifest)}};
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  Json node = {{"mesh", 0}};
  if (is_far(mesh.frame)) node["translation"] = Json::array({translation.x, translation.z, 0 - translation.y});
  root["nodes"] = Json::array({node});
  root["meshes"] = Json::array(
      {{{"primitives",
         Json::array(
             {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}, {"indices", 2}, {"material", 0}, {"mode", kGltfTriangles}}})}}});
  root["materials"] = Json::array({{{"pbrMetallicRoughness",
                                     {{"baseColorFactor", Json::array({kGround[0], kGround[1], kGround[2], 1.0})},
                                      {"metallicFactor", 0.0},
                                      {"roughnessFactor", 1.0}}}}});
  root["accessors"] = buffer.accessors;
  root["bufferViews"] = buffer.views;
  root["buffers"] = Json::array({{{"byteLength", buffer.bytes.size()}}});
  root["extras"] = {{"level", mesh.level}, {"longitude", mesh.longitude_deg}, {"latitude", mesh.latitude_deg}};
  if (mesh.frame == MeshFrame::map)
    root["extras"].update({{"crs", mesh.map.code}, {"unit", mesh.map.unit}, {"vertical_datum", mesh.map.geoid}});
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

bool write_glb(std::ostream& out, const ExtractedMesh& mesh, const proto::Manifest& manifest) {
  const Vec3 translation = translation_of(mesh);
  GlbBuffer buffer = buffer_of(mesh, translation);
  std::string json = json_of(mesh, manifest, buffer, translation);
  append(out, pack_glb(std::move(json), std::move(buffer.bytes)));
  return static_cast<bool>(out.flush());
}

}  // namespace cordillera::pipeline::exports
