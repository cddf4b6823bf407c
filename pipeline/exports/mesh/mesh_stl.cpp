#include <bit>
#include <cmath>

#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/exports/whole_file.h"

namespace cordillera::pipeline::exports {
namespace {

using proto::Vec3;

constexpr std::size_t kHeader = 80, kPiece = std::size_t{1} << 16;

void append_point(std::string& out, const Vec3& p) {
  for (const double value : {p.x, p.y, p.z}) append_little_endian(out, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

/// A header that began with "solid" would say that text follows.
std::string header_of(const proto::Manifest& manifest) {
  std::string text = "Cordillera: " + title_of(manifest);
  if (!manifest.attribution().empty()) text += ", " + manifest.attribution();
  text.resize(kHeader, ' ');
  return text;
}

}  // namespace

bool write_stl(std::ostream& out, const ExtractedMesh& mesh, const proto::Manifest& manifest) {
  const proto::TriangleMesh& m = mesh.mesh;
  std::string bytes = header_of(manifest);
  append_little_endian(bytes, static_cast<std::uint32_t>(m.triangles.size()));
  for (const auto& t : m.triangles) {
    const Vec3 a{m.x[t[0]], m.y[t[0]], m.z[t[0]]}, b{m.x[t[1]], m.y[t[1]], m.z[t[1]]}, c{m.x[t[2]], m.y[t[2]], m.z[t[2]]};
    const Vec3 across = cross(b - a, c - a);
    const double length = std::sqrt(dot(across, across));
    append_point(bytes, length > 0 ? (1 / length) * across : Vec3{});
    for (const Vec3& p : {a, b, c}) append_point(bytes, p);
    bytes.append(2, '\0');
    if (bytes.size() < kPiece) continue;
    append(out, bytes);
    bytes.clear();
  }
  append(out, bytes);
  return static_cast<bool>(out.flush());
}

}  // namespace cordillera::pipeline::exports
