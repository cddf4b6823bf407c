// OFF, as Geomview has it: a keyword, three counts, vertices, polygons; a line each; # begins a comment.
#include <array>
#include <cmath>

#include "proto/mesh_file/formats.h"
#include "proto/numbers.h"

namespace cordillera::proto {
namespace {

constexpr const char* kKeywords = "OFF, or COFF, NOFF, CNOFF with colours and normals, as text";
/// Behind a position may stand a normal, a colour, a texture coordinate.
constexpr int kMostExtras = 9;

struct Counts {
  std::uint64_t vertices = 0, triangles = 0;
};

class OffReader {
 public:
  explicit OffReader(MeshSource& source) : source_(source), lines_(source, '#', 0) {}

  Result<MeshFile> read() {
    const auto counts = header();
    if (!counts) return counts.problem();
    MeshFile file;
    file.encoding = {MeshFormat::off, CoordinateType::float64};
    TriangleMesh& mesh = file.mesh;
    for (auto* axis : {&mesh.x, &mesh.y, &mesh.z}) axis->reserve(source_.room_for(counts->vertices));
    for (std::uint64_t v = 0; v < counts->vertices; ++v) {
      if (auto read = vertex(v, *counts, mesh); !read) return read.problem();
    }
    mesh.triangles.reserve(source_.room_for(counts->triangles));
    for (std::uint64_t t = 0; t < counts->triangles; ++t) {
      if (auto read = triangle(t, *counts, mesh); !read) return read.problem();
    }
    if (lines_.next()) return wrong("the file goes on after its last polygon", "nothing after the polygons that were announced");
    return file;
  }

 private:
  Problem wrong(const std::string& what, const std::string& accepted) const {
    return source_.invalid_line(lines_.line(), what, accepted);
  }
  static std::string of(const char* what, std::uint64_t index, std::uint64_t count) {
    return std::string(what) + " " + std::to_string(index) + " of " + std::to_string(count);
  }

  /// The counts may stand on the keyword's line.
  Result<Counts> header() {
    if (!lines_.next()) return source_.short_line("the header");
    const std::string keyword(lines_.word());
    if (keyword != "OFF" && keyword != "COFF" && keyword != "NOFF" && keyword != "CNOFF") {
      return wrong("an OFF file does not begin with " + shown(keyword), kKeywords);
    }
    std::string word(lines_.word());
    if (word == "BINARY") return wrong("this is a binary OFF", kKeywords);
    if (word.empty()) {
      if (!lines_.next()) return source_.short_line("the header");
      word = lines_.word();
    }
    Counts counts;
    std::uint64_t edges = 0;
    for (std::uint64_t* count : {&counts.vertices, &counts.triangles, &edges}) {
      const auto read = signed_number<std::uint64_t>(word);
      if (!read) {
        return wrong("the counts have " + (word.empty() ? "an end" : shown(word)), "three counts: vertices, polygons, edges");
      }
      *count = *read;
      word = lines_.word();
    }
    if (!word.empty()) return wrong("the counts go on with " + shown(word), "three counts: vertices, polygons, edges");
    if (counts.vertices > kMostVertices) {
      return wrong(std::to_string(counts.vertices) + " vertices are too many", "fewer than 2^32");
    }
    return counts;
  }

  Result<void> vertex(std::uint64_t v, const Counts& counts, TriangleMesh& mesh) {
    if (!lines_.next()) return source_.short_line(of("vertex", v, counts.vertices));
    for (auto* axis : {&mesh.x, &mesh.y, &mesh.z}) {
      const std::string_view word = lines_.word();
      if (word.empty()) return wrong("vertex " + std::to_string(v) + " has no three coordinates", "x y z on a line");
      const auto read = signed_number<double>(word);
      if (!read || !std::isfinite(*read)) return wrong("vertex " + std::to_string(v) + " has " + shown(word), kFiniteNumber);
      axis->push_back(*read);
    }
    return extras("vertex", v);
  }

  Result<void> triangle(std::uint64_t t, const Counts& counts, TriangleMesh& mesh) {
    if (!lines_.next()) return source_.short_line(of("polygon", t, counts.triangles));
    const std::string size(lines_.word());
    const auto corners = signed_number<std::uint64_t>(size);
    if (!corners) {
      return wrong("polygon " + std::to_string(t) + " begins with " + shown(size), "the number of its corners, which is 3");
    }
    if (*corners != 3) return wrong("polygon " + std::to_string(t) + " has " + size + " corners", kOnlyTriangles);
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& corner : triangle) {
      const std::string_view word = lines_.word();
      const auto index = signed_number<std::int64_t>(word);
      if (!index) {
        return wrong("polygon " + std::to_string(t) + " has " + (word.empty() ? "not all of its corners" : shown(word)),
                     "3 vertices");
      }
      if (*index < 0 || *index >= static_cast<std::int64_t>(counts.vertices)) {
        return wrong(out_of_range(t, static_cast<double>(*index), counts.vertices), "");
      }
      corner = static_cast<std::uint32_t>(*index);
    }
    mesh.triangles.push_back(triangle);
    return extras("polygon", t);
  }

  /// Colours and the like are numbers: anything else is a file that broke.
  Result<void> extras(const char* what, std::uint64_t index) {
    int extras = 0;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
      if (!signed_number<double>(word)) return wrong(of_line(what, index) + shown(word), "numbers");
      if (++extras > kMostExtras) return wrong(of_line(what, index) + "too many numbers", "a line for each");
    }
    return {};
  }
  static std::string of_line(const char* what, std::uint64_t index) {
    return std::string(what) + " " + std::to_string(index) + " is followed by ";
  }

  MeshSource& source_;
  TextLines lines_;
};

}  // namespace

Result<MeshFile> read_off(MeshSource& source) { return OffReader(source).read(); }

void write_off(MeshText& out, const TriangleMesh& mesh) {
  out.row() += "OFF\n" + std::to_string(mesh.vertices()) + " " + std::to_string(mesh.triangles.size()) + " 0\n";
  write_rows<double>(out, mesh);
}

}  // namespace cordillera::proto
