#include <algorithm>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/lit_mesh.h"
#include "pipeline/encode/little_endian.h"

namespace cordillera::pipeline {
namespace {

using proto::Vec3;

constexpr int kFloat = 5126, kUnsignedShort = 5123, kUnsignedInt = 5125;  // glTF component types
constexpr int kTriangleMode = 4;

// glTF is y-up; 3D Tiles viewers turn y up into z up on load. A permutation: exact.
std::array<float, 3> y_up(Vec3 p) { return {static_cast<float>(p.x), static_cast<float>(p.z), static_cast<float>(-p.y)}; }

LitSurface relative(const LitMesh::Surface& surface, Vec3 translation) {
  LitSurface out;
  for (const Vec3& p : surface.points) out.positions.push_back(y_up(p - translation));
  for (const Vec3& n : surface.normals) out.normals.push_back(y_up(n));
  out.triangles = surface.triangles;
  return out;
}

struct Document {
  Json accessors = Json::array(), views = Json::array(), primitives = Json::array();
  std::string binary;
};

void add_accessor(Document& doc, int component, std::size_t count, const char* type) {
  doc.accessors.push_back({{"componentType", component}, {"count", count}, {"type", type}});
}

void add_primitive(Document& doc, const LitSurface& surface, const FloatGrid& grid) {
  const std::string draco = draco_encode(surface, grid);
  const std::size_t view = doc.views.size(), accessor = doc.accessors.size();
  doc.views.push_back({{"buffer", 0}, {"byteOffset", doc.binary.size()}, {"byteLength", draco.size()}});
  doc.binary += draco;
  pad(doc.binary, 4, '\0');

  std::array<float, 3> low = surface.positions[0], high = low;
  for (const auto& p : surface.positions) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const std::size_t points = surface.positions.size();
  add_accessor(doc, points < UINT16_MAX ? kUnsignedShort : kUnsignedInt, 3 * surface.triangles.size(), "SCALAR");
  add_accessor(doc, kFloat, points, "VEC3");
  doc.accessors.back()["min"] = low;
  doc.accessors.back()["max"] = high;
  add_accessor(doc, kFloat, points, "VEC3");
  doc.primitives.push_back(
      {{"attributes", {{"POSITION", accessor + 1}, {"NORMAL", accessor + 2}}},
       {"indices", accessor},
       {"material", 0},
       {"mode", kTriangleMode},
       {"extensions",
        {{"KHR_draco_mesh_compression",
          {{"bufferView", view}, {"attributes", {{"POSITION", kDracoPosition}, {"NORMAL", kDracoNormal}}}}}}}});
}

std::string document_json(Document& doc, const EncodeInput& input, Vec3 t) {
  const Json needed = Json::array({"KHR_draco_mesh_compression"});
  Json root;
  root["asset"] = {{"version", "2.0"}, {"generator", "Cordillera"}};
  if (!input.attribution.empty()) root["asset"]["copyright"] = input.attribution;
  if (!input.title.empty()) root["asset"]["extras"] = {{"title", input.title}};
  root["extensionsUsed"] = needed;
  root["extensionsRequired"] = needed;
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  root["nodes"] = Json::array({{{"mesh", 0}, {"translation", Json::array({t.x, t.z, 0 - t.y})}}});
  root["meshes"] = Json::array({{{"primitives", std::move(doc.primitives)}}});
  // Dry grass and rock; lit by whatever light the viewer has, from above only.
  root["materials"] = Json::array(
      {{{"pbrMetallicRoughness",
         {{"baseColorFactor", Json::array({0.47, 0.43, 0.33, 1.0})}, {"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}});
  root["accessors"] = std::move(doc.accessors);
  root["bufferViews"] = std::move(doc.views);
  root["buffers"] = Json::array({{{"byteLength", doc.binary.size()}}});
  root["extras"] = {{"geometric_error", input.geometric_error_m}};
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string encode_glb(const EncodeInput& input) {
  const LitMesh mesh = lit_mesh(input);
  if (mesh.terrain.triangles.empty()) return {};
  const FloatGrid grid{static_cast<float>(mesh.step_m), mesh.bits};
  Document doc;
  add_primitive(doc, relative(mesh.terrain, mesh.translation), grid);
  if (!mesh.skirts.triangles.empty()) add_primitive(doc, relative(mesh.skirts, mesh.translation), grid);
  std::string json = document_json(doc, input, mesh.translation);
  return pack_glb(std::move(json), std::move(doc.binary));
}

}  // namespace cordillera::pipeline
