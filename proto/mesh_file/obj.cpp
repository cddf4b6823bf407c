// Wavefront OBJ: `v` and `f` lines; the rest of what such files hold is skipped. Vertices are counted from 1, or back from the
// last.
#include <algorithm>
#include <array>
#include <cmath>

#include "proto/mesh_file/formats.h"
#include "proto/numbers.h"

namespace cordillera::proto {
namespace {

/// Statements that say nothing of vertices and triangles. A file without counts can only be known as broken by its words.
constexpr std::array<std::string_view, 12> kSkipped = {"vn", "vt", "vp",     "g",      "o",  "s",
                                                       "l",  "p",  "usemtl", "mtllib", "mg", "maplib"};

constexpr const char* kVertices = "vertices from 1, or back from -1";

class ObjReader {
 public:
  explicit ObjReader(MeshSource& source) : source_(source), lines_(source, '#', '\\') {}

  Result<MeshFile> read() {
    file_.encoding = {MeshFormat::obj, CoordinateType::float64};
    while (lines_.next()) {
      const std::string keyword(lines_.word());
      if (keyword == "v") {
        if (auto read = vertex(); !read) return read.problem();
      } else if (keyword == "f") {
        if (auto read = triangle(); !read) return read.problem();
      } else if (std::find(kSkipped.begin(), kSkipped.end(), keyword) == kSkipped.end()) {
        return wrong("a statement begins with " + shown(keyword),
                     "v, f, and vn, vt, g, o, s, l, p, usemtl, mtllib, which are skipped");
      }
    }
    // A triangle may name a vertex that comes later: only now it is known whether it came.
    if (greatest_ > file_.mesh.vertices()) { return source_.invalid_line(greatest_line_, beyond(greatest_), kVertices); }
    return std::move(file_);
  }

 private:
  Problem wrong(const std::string& what, const std::string& accepted) const {
    return source_.invalid_line(lines_.line(), what, accepted);
  }
  std::string beyond(std::uint64_t index) const {
    return "a triangle has vertex " + std::to_string(index) + ", but there are " + std::to_string(file_.mesh.vertices());
  }

  Result<void> vertex() {
    TriangleMesh& mesh = file_.mesh;
    const std::string name = "vertex " + std::to_string(mesh.vertices() + 1);
    if (mesh.vertices() == kMostVertices) return wrong(name + " is one too many", "fewer than 2^32");
    for (auto* axis : {&mesh.x, &mesh.y, &mesh.z}) {
      const std::string_view word = lines_.word();
      if (word.empty()) return wrong(name + " has no three coordinates", "v x y z");
      const auto read = signed_number<double>(word);
      if (!read || !std::isfinite(*read)) return wrong(name + " has " + shown(word), kFiniteNumber);
      axis->push_back(*read);
    }
    // A weight or a colour.
    int extras = 0;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
      if (!signed_number<double>(word) || ++extras > kMostExtras) {
        return wrong(name + " is followed by " + shown(word), "v x y z [w] [r g b]");
      }
    }
    return {};
  }

  Result<void> triangle() {
    std::array<std::uint32_t, 3> triangle{};
    std::size_t corners = 0;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word(), ++corners) {
      const auto index = corner(word);
      if (!index) return index.problem();
      if (corners < 3) triangle[corners] = *index;
    }
    const std::size_t count = file_.mesh.triangles.size() + 1;
    if (corners != 3) {
      return wrong("polygon " + std::to_string(count) + " has " + std::to_string(corners) + " corners", kOnlyTriangles);
    }
    file_.mesh.triangles.push_back(triangle);
    return {};
  }

  /// a, a/t, a//n or a/t/n: a, counted from 0.
  Result<std::uint32_t> corner(std::string_view word) {
    const std::size_t slash = word.find('/');
    const auto index = signed_number<std::int64_t>(word.substr(0, slash));
    const bool rest = slash == std::string_view::npos || whole_numbers(word.substr(slash + 1));
    if (!index || !rest) return wrong("a polygon has the corner " + shown(word), "corners as v, v/vt, v//vn or v/vt/vn");
    const auto known = static_cast<std::int64_t>(file_.mesh.vertices());
    const std::int64_t place = *index < 0 ? known + *index : *index - 1;
    if (*index == 0 || place < 0) {
      return wrong("a triangle has vertex " + std::to_string(*index) + ", with " + std::to_string(known) + " before it",
                   kVertices);
    }
    if (place >= static_cast<std::int64_t>(kMostVertices)) {
      return wrong(beyond(static_cast<std::uint64_t>(*index)), "fewer than 2^32");
    }
    if (place >= known && static_cast<std::uint64_t>(place) + 1 > greatest_) {
      greatest_ = static_cast<std::uint64_t>(place) + 1;
      greatest_line_ = lines_.line();
    }
    return static_cast<std::uint32_t>(place);
  }
  static bool whole_numbers(std::string_view words) {
    const std::size_t slash = words.find('/');
    const auto one = [](std::string_view word) { return word.empty() || signed_number<std::int64_t>(word); };
    return one(words.substr(0, slash)) && (slash == std::string_view::npos || one(words.substr(slash + 1)));
  }

  static constexpr int kMostExtras = 4;
  MeshSource& source_;
  TextLines lines_;
  MeshFile file_;
  std::uint64_t greatest_ = 0, greatest_line_ = 0;  // of vertices that were named before they came
};

}  // namespace

Result<MeshFile> read_obj(MeshSource& source) { return ObjReader(source).read(); }

void write_obj(MeshText& out, const TriangleMesh& mesh, const MeshEncoding& encoding) {
  for (const std::string& comment : encoding.comments) out.row() += "# " + comment + "\n";
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    out.row() += "v ";
    append_position<double>(out.row(), mesh, v);
    out.row() += '\n';
  }
  for (const auto& triangle : mesh.triangles) {
    std::string& row = out.row();
    row += 'f';
    for (const std::uint32_t corner : triangle) append_number(row += ' ', std::uint64_t{corner} + 1);
    row += '\n';
  }
}

}  // namespace cordillera::proto
