// One uncompressed primitive: every program that reads glTF reads it.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/exports/whole_file.h"

namespace cordillera::pipeline::exports {
namespace {

using proto::Vec3;
using Point = std::array<float, 3>;

constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963, kTriangles = 4;

/// glTF's y is up.
Point y_up(const Vec3& p) { return {static_cast<float>(p.x), static_cast<float>(p.z), static_cast<float>(0 - p.y)}; }

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

void append_point(std::string& out, const Point& p) {
  for (const float value : p) append_little_endian(out, std::bit_cast<std::uint32_t>(value));
}

struct Binary {
  std::string bytes;
  Point low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
};

/// Positions, normals, indices.
Binary binary_of(const ExtractedMesh& mesh, const Vec3& translation) {
  Binary out;
  out.bytes.reserve(24 * mesh.mesh.vertices() + 12 * mesh.mesh.triangles.size());
  for (std::uint32_t v = 0; v < mesh.mesh.vertices(); ++v) {
    const Point p = y_up(vertex(mesh.mesh, v) - translation);
    for (std::size_t k = 0; k < 3; ++k) {
      out.low[k] = std::min(out.low[k], p[k]);
      out.high[k] = std::max(out.high[k], p[k]);
    }
    append_point(out.bytes, p);
  }
  for (const Vec3& n : normals_of(mesh.mesh)) append_point(out.bytes, y_up(n));
  for (const auto& t : mesh.mesh.triangles) {
    for (const std::uint32_t v : t) append_little_endian(out.bytes, v);
  }
  return out;
}

Json view(std::size_t offset, std::size_t length, int target) {
  return {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
}

std::string json_of(const ExtractedMesh& mesh, const proto::Manifest& manifest, const Binary& binary, const Vec3& translation) {
  const std::size_t points = mesh.mesh.vertices(), indices = 3 * mesh.mesh.triangles.size();
  Json root;
  root["asset"] = {{"version", "2.0"}, {"generator", "Cordillera"}};
  if (!manifest.attribution().empty()) root["asset"]["copyright"] = manifest.attribution();
  root["asset"]["extras"] = {{"title", title_of(manifest)}};
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  Json node = {{"mesh", 0}};
  if (mesh.frame == MeshFrame::ecef) node["translation"] = Json::array({translation.x, translation.z, 0 - translation.y});
  root["nodes"] = Json::array({node});
  root["meshes"] = Json::array(
      {{{"primitives",
         Json::array(
             {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}}}, {"indices", 2}, {"material", 0}, {"mode", kTriangles}}})}}});
  root["materials"] = Json::array(
      {{{"pbrMetallicRoughness",
         {{"baseColorFactor", Json::array({0.47, 0.43, 0.33, 1.0})}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}});
  root["accessors"] = Json::array({{{"bufferView", 0},
                                    {"componentType", kFloat},
                                    {"count", points},
                                    {"type", "VEC3"},
                                    {"min", binary.low},
                                    {"max", binary.high}},
                                   {{"bufferView", 1}, {"componentType", kFloat}, {"count", points}, {"type", "VEC3"}},
                                   {{"bufferView", 2}, {"componentType", kUnsignedInt}, {"count", indices}, {"type", "SCALAR"}}});
  root["bufferViews"] = Json::array({view(0, 12 * points, kArrayBuffer), view(12 * points, 12 * points, kArrayBuffer),
                                     view(24 * points, 4 * indices, kElementArrayBuffer)});
  root["buffers"] = Json::array({{{"byteLength", binary.bytes.size()}}});
  root["extras"] = {{"level", mesh.level}, {"longitude", mesh.longitude_deg}, {"latitude", mesh.latitude_deg}};
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

bool write_glb(std::ostream& out, const ExtractedMesh& mesh, const proto::Manifest& manifest) {
  const Vec3 translation = mesh.frame == MeshFrame::ecef ? mesh.origin_m : Vec3{};
  Binary binary = binary_of(mesh, translation);
  std::string json = json_of(mesh, manifest, binary, translation);
  append(out, pack_glb(std::move(json), std::move(binary.bytes)));
  return static_cast<bool>(out.flush());
}

}  // namespace cordillera::pipeline::exports
