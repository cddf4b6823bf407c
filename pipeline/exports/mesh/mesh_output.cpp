#include "pipeline/exports/mesh/mesh_output.h"

#include <array>
#include <cmath>

#include "pipeline/encode/json.h"
#include "pipeline/exports/archive_metadata.h"
#include "proto/mesh_file/mesh_file.h"

namespace cordillera::pipeline::exports {
namespace {

struct OutputKind {
  MeshKind kind;
  std::string_view ending, type;
};
constexpr std::array<OutputKind, 4> kKinds = {{{MeshKind::glb, "glb", "model/gltf-binary"},
                                               {MeshKind::ply, "ply", "application/octet-stream"},
                                               {MeshKind::obj, "obj", "model/obj"},
                                               {MeshKind::stl, "stl", "model/stl"}}};

std::string frame_sentence(const ExtractedMesh& mesh) {
  const auto number = [](double value) { return Json(value).dump(); };
  switch (mesh.frame) {
    case MeshFrame::ecef: return "metres, earth-centred, earth-fixed (EPSG:4978)";
    case MeshFrame::geodetic: return "longitude and latitude in degrees, metres above the WGS 84 ellipsoid";
    case MeshFrame::map:
      return "east and north in " + mesh.map.label + ", heights above " + mesh.map.geoid + ", in " + mesh.map.unit;
    default: break;
  }
  return "metres east, north and up of longitude " + number(mesh.longitude_deg) + ", latitude " + number(mesh.latitude_deg) +
         ", height 0 above the WGS 84 ellipsoid";
}

/// A line each, for the heads of text formats.
std::vector<std::string> comments_of(const ExtractedMesh& mesh, const proto::Manifest& manifest) {
  std::vector<std::string> lines = {title_of(manifest), manifest.attribution(), "level " + std::to_string(mesh.level),
                                    frame_sentence(mesh), mesh.map.code.empty() ? "" : "crs: " + mesh.map.code};
  std::erase(lines, "");
  for (std::string& line : lines) {
    for (char& c : line) c = c == '\n' || c == '\r' ? ' ' : c;
  }
  return lines;
}

/// Text is short then, and no lattice is as fine.
void round_to_millimetres(std::vector<double>& axis) {
  for (double& value : axis) value = std::round(value * 1000) / 1000;
}

}  // namespace

std::optional<MeshKind> mesh_kind(std::string_view ending) {
  for (const OutputKind& kind : kKinds) {
    if (kind.ending == ending) return kind.kind;
  }
  return std::nullopt;
}

std::vector<std::string> mesh_endings() {
  std::vector<std::string> endings;
  for (const OutputKind& kind : kKinds) endings.emplace_back(kind.ending);
  return endings;
}

std::string mesh_endings_text(std::string_view last) {
  std::string text;
  for (const OutputKind& kind : kKinds) {
    const bool first = &kind == kKinds.begin(), ends = &kind == kKinds.end() - 1;
    text.append(first ? "" : ends ? last : ", ").append(".").append(kind.ending);
  }
  return text;
}

std::string_view media_type(MeshKind kind) { return kKinds[static_cast<std::size_t>(kind)].type; }

proto::Result<void> check_frame(MeshKind kind, MeshFrame frame) {
  const bool degrees = frame == MeshFrame::geodetic && (kind == MeshKind::glb || kind == MeshKind::stl);
  if (!degrees && !(is_far(frame) && kind == MeshKind::stl)) return {};
  const std::string format(kKinds[static_cast<std::size_t>(kind)].ending);
  return proto::Problem{
      "options-conflict", "." + format + " has 32-bit floats, which would move such coordinates by half a metre and more",
      kind == MeshKind::stl ? "frame=enu, or ply or obj" : "frame=enu, ecef or a projected CRS, or ply or obj", "frame"};
}

bool write_mesh(std::ostream& out, const ExtractedMesh& mesh, MeshKind kind, const proto::Manifest& manifest) {
  if (kind == MeshKind::glb) return write_glb(out, mesh, manifest);
  if (kind == MeshKind::stl) return write_stl(out, mesh, manifest);
  proto::MeshEncoding encoding;
  encoding.comments = comments_of(mesh, manifest);
  if (kind == MeshKind::ply) {
    encoding.coordinates = mesh.frame == MeshFrame::enu ? proto::CoordinateType::float32 : proto::CoordinateType::float64;
    return proto::write_mesh(out, mesh.mesh, encoding);
  }
  encoding.format = proto::MeshFormat::obj;
  if (mesh.frame == MeshFrame::geodetic) return proto::write_mesh(out, mesh.mesh, encoding);
  proto::TriangleMesh rounded = mesh.mesh;
  for (auto* axis : {&rounded.x, &rounded.y, &rounded.z}) round_to_millimetres(*axis);
  return proto::write_mesh(out, rounded, encoding);
}

}  // namespace cordillera::pipeline::exports
