#include "pipeline/encode/decode.h"

#include "pipeline/encode/glb.h"
#include "pipeline/encode/strange_json.h"

namespace cordillera::pipeline {
namespace {

proto::Problem damaged(const std::string& why) { return {"tile-damaged", why, "bytes of a .glb tile that Cordillera wrote", ""}; }

proto::Vec3 z_up(std::array<float, 3> p) { return {p[0], -p[2], p[1]}; }

proto::Result<LitSurface> primitive(const Json& root, const Json& primitive, std::string_view binary) {
  const Json& view =
      root.at("bufferViews").at(primitive.at("extensions").at("KHR_draco_mesh_compression").at("bufferView").get<std::size_t>());
  const auto offset = view.at("byteOffset").get<std::size_t>(), size = view.at("byteLength").get<std::size_t>();
  if (offset > binary.size() || size > binary.size() - offset) return damaged("a buffer view leaves its buffer");
  proto::Result<LitSurface> surface = draco_decode_lit(binary.substr(offset, size));
  if (!surface) return surface;
  if (primitive.at("attributes").contains("NORMAL") && surface->normals.empty()) return damaged("Draco decodes no normals");
  const Json& position = root.at("accessors").at(primitive.at("attributes").at("POSITION").get<std::size_t>());
  if (position.at("count") != surface->positions.size()) return damaged("an accessor's count is not what Draco decodes");
  return surface;
}

proto::Result<DecodedGlb> decode(const Json& root, std::string_view binary) {
  DecodedGlb out;
  const auto t = root.at("nodes").at(0).at("translation").get<std::array<double, 3>>();
  out.translation = {t[0], -t[2], t[1]};
  const Json& primitives = root.at("meshes").at(0).at("primitives");
  const auto terrain = primitive(root, primitives.at(0), binary);
  if (!terrain) return terrain.problem();
  for (const auto& p : terrain->positions) out.points.push_back(z_up(p) + out.translation);
  for (const auto& n : terrain->normals) out.normals.push_back(z_up(n));
  out.triangles = terrain->triangles;
  if (primitives.size() < 2) return out;
  const auto skirts = primitive(root, primitives.at(1), binary);
  if (!skirts) return skirts.problem();
  for (const auto& p : skirts->positions) out.skirt_points.push_back(z_up(p) + out.translation);
  out.skirt_triangles = skirts->triangles;
  return out;
}

}  // namespace

proto::Result<DecodedDrc> decode_drc(std::string_view bytes) { return draco_decode_lattice(bytes); }

proto::Result<DecodedGlb> decode_glb(std::string_view bytes) {
  const auto chunks = unpack_glb(bytes);
  if (!chunks) return chunks.problem();
  try {
    return decode(json_of_stranger(chunks->first), chunks->second);
  } catch (const Json::exception&) { return damaged("its JSON is not that of a tile in tiles/"); }
}

}  // namespace cordillera::pipeline
