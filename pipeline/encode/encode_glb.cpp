#include <cmath>
#include <utility>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/lit_mesh.h"

namespace cordillera::pipeline {
namespace {

using proto::Vec3;

// glTF's v runs down a picture, so north is up in it; its tangent is where u grows, and with w = 1 and up as the normal
// cross(normal, tangent) = north is where green points.
std::array<float, 2> texcoord(const std::array<double, 2>& place) {
  const auto at = [](double share) {
    const double steps = std::nearbyint(share * kPlacesAcross);
    return static_cast<float>((0.5 + steps * (kNormalMapSide - 1) / kPlacesAcross) / kNormalMapSide);
  };
  return {at(place[0]), at(1 - place[1])};
}

LitSurface relative(const LitMesh::Surface& surface, Vec3 translation) {
  LitSurface out;
  for (const Vec3& p : surface.points) out.positions.push_back(y_up(p - translation));
  out.triangles = surface.triangles;
  for (const auto& place : surface.places) out.texcoords.push_back(texcoord(place));
  for (const Vec3& n : surface.normals) out.normals.push_back(y_up(n));
  for (const Vec3& e : surface.east) {
    const auto [x, y, z] = y_up(e);
    out.tangents.push_back({x, y, z, 1});
  }
  return out;
}

struct Document {
  GlbBuffer buffer;
  Json primitives = Json::array();
};

void add_primitive(Document& doc, const LitSurface& surface, const FloatGrid& grid) {
  const std::size_t view = doc.buffer.add_view(draco_encode(surface, grid));
  const std::size_t points = surface.positions.size();
  const std::size_t indices = doc.buffer.add_accessor(index_type(points), 3 * surface.triangles.size(), "SCALAR");
  Json attributes = {{"POSITION", doc.buffer.add_accessor(kGltfFloat, points, "VEC3")}}, coded = {{"POSITION", 0}};
  doc.buffer.add_bounds(surface.positions);
  const auto add = [&](const char* name, const char* type) {
    attributes[name] = doc.buffer.add_accessor(kGltfFloat, points, type);
    const std::size_t id = coded.size();
    coded[name] = id;
  };
  if (!surface.normals.empty()) add("NORMAL", "VEC3");
  if (!surface.tangents.empty()) add("TANGENT", "VEC4");
  if (!surface.texcoords.empty()) add("TEXCOORD_0", "VEC2");
  doc.primitives.push_back(
      {{"attributes", std::move(attributes)},
       {"indices", indices},
       {"material", 0},
       {"mode", kGltfTriangles},
       {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", std::move(coded)}}}}}});
}

/// A picture as a texture, and its number. There is no second one for clients that do not read WebP.
std::size_t add_texture(Json& root, std::size_t view) {
  constexpr int kLinear = 9729, kLinearMipmapLinear = 9987, kClampToEdge = 33071;
  const std::size_t number = root.contains("images") ? root["images"].size() : 0;
  root["textures"].push_back({{"sampler", 0}, {"extensions", {{"EXT_texture_webp", {{"source", number}}}}}});
  root["samplers"] = Json::array(
      {{{"magFilter", kLinear}, {"minFilter", kLinearMipmapLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}}});
  root["images"].push_back({{"bufferView", view}, {"mimeType", "image/webp"}});
  return number;
}

/// Texture coordinates are those of a normal map: its outer pixels have their middle on the tile's sides. So have a larger
/// photo's, but they are smaller. A client that does not know the extension is off by a third of a normal map's pixel.
Json place_of_photo(std::uint32_t side) {
  constexpr double kCells = kNormalMapSide - 1, kMap = kNormalMapSide;
  const double offset = 0.5 / side * (1 - (side - 1) / kCells), scale = kMap * (side - 1) / (kCells * side);
  return {{"offset", {offset, offset}}, {"scale", {scale, scale}}};
}

/// Extensions that a client has to know, and others.
struct Extensions {
  Json needed, useful;
};

void add_pictures(Json& root, Document& doc, const Shading& shading, Extensions& extensions) {
  // A new name in an ordered object may move all others: nothing of root is held while textures are added.
  if (!shading.photo.empty()) {
    Json texture = {{"index", add_texture(root, doc.buffer.add_view(shading.photo))}};
    if (shading.photo_side != kNormalMapSide) {
      texture["extensions"] = {{"KHR_texture_transform", place_of_photo(shading.photo_side)}};
      extensions.useful.push_back("KHR_texture_transform");
    }
    Json& colours = root["materials"][0]["pbrMetallicRoughness"];
    colours.erase("baseColorFactor");
    colours["baseColorTexture"] = std::move(texture);
  }
  if (shading.normals == Normals::texture) {
    const std::size_t texture = add_texture(root, doc.buffer.add_view(shading.picture));
    root["materials"][0]["normalTexture"] = {{"index", texture}};
  }
  if (shading.has_places()) extensions.needed.push_back("EXT_texture_webp");
}

std::string document_json(Document& doc, const EncodeInput& input, Vec3 t) {
  Extensions extensions{Json::array({"KHR_draco_mesh_compression"}), Json::array()};
  Json root;
  root["asset"] = {{"version", "2.0"}, {"generator", "Cordillera"}};
  if (!input.attribution.empty()) root["asset"]["copyright"] = input.attribution;
  if (!input.title.empty()) root["asset"]["extras"] = {{"title", input.title}};
  for (const char* later : {"extensionsUsed", "extensionsRequired"}) root[later] = nullptr;
  root["scene"] = 0;
  root["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  root["nodes"] = Json::array({{{"mesh", 0}, {"translation", Json::array({t.x, t.z, 0 - t.y})}}});
  root["meshes"] = Json::array({{{"primitives", std::move(doc.primitives)}}});
  root["materials"] = Json::array({{{"pbrMetallicRoughness",
                                     {{"baseColorFactor", Json::array({kGround[0], kGround[1], kGround[2], 1.0})},
                                      {"metallicFactor", 0.0},
                                      {"roughnessFactor", 1.0}}}}});
  add_pictures(root, doc, input.shading, extensions);
  root["extensionsRequired"] = root["extensionsUsed"] = extensions.needed;
  for (Json& name : extensions.useful) root["extensionsUsed"].push_back(std::move(name));
  root["accessors"] = std::move(doc.buffer.accessors);
  root["bufferViews"] = std::move(doc.buffer.views);
  root["buffers"] = Json::array({{{"byteLength", doc.buffer.bytes.size()}}});
  root["extras"] = {{"geometric_error", input.geometric_error_m}};
  return root.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string encode_glb(const EncodeInput& input, const PublishedMesh& published) {
  const LitMesh mesh = lit_mesh(input, published);
  if (mesh.terrain.triangles.empty()) return {};
  const FloatGrid grid{static_cast<float>(mesh.step_m), mesh.bits};
  Document doc;
  add_primitive(doc, relative(mesh.terrain, mesh.translation), grid);
  if (!mesh.skirts.triangles.empty()) add_primitive(doc, relative(mesh.skirts, mesh.translation), grid);
  std::string json = document_json(doc, input, mesh.translation);
  return pack_glb(std::move(json), std::move(doc.buffer.bytes));
}

}  // namespace cordillera::pipeline
