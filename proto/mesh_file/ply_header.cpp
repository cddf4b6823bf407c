#include "proto/mesh_file/ply_header.h"

#include <array>
#include <sstream>

#include "proto/mesh_file/formats.h"

namespace cordillera::proto {
namespace {

struct TypeName {
  const char* name;
  PlyType type;
};
constexpr std::array<TypeName, 16> kTypes = {{{"char", PlyType::int8},
                                              {"int8", PlyType::int8},
                                              {"uchar", PlyType::uint8},
                                              {"uint8", PlyType::uint8},
                                              {"short", PlyType::int16},
                                              {"int16", PlyType::int16},
                                              {"ushort", PlyType::uint16},
                                              {"uint16", PlyType::uint16},
                                              {"int", PlyType::int32},
                                              {"int32", PlyType::int32},
                                              {"uint", PlyType::uint32},
                                              {"uint32", PlyType::uint32},
                                              {"float", PlyType::float32},
                                              {"float32", PlyType::float32},
                                              {"double", PlyType::float64},
                                              {"float64", PlyType::float64}}};

std::optional<PlyType> type_called(const std::string& name) {
  for (const TypeName& known : kTypes) {
    if (name == known.name) return known.type;
  }
  return std::nullopt;
}

/// Header lines are long in no file that we know; a "header" without an end must not fill the memory.
constexpr std::size_t kLongestLine = 4096;

class PlyHeaderReader {
 public:
  explicit PlyHeaderReader(MeshSource& source) : source_(source) {}

  Result<PlyHeader> read() {
    if (!next() || line_ != "ply") return wrong("a PLY does not begin with " + shown(line_), "ply");
    if (!next()) return source_.short_line("the header");
    if (auto format = read_format(); !format) return format.problem();
    while (next()) {
      std::istringstream words(line_);
      std::string keyword;
      words >> keyword;
      if (keyword == "end_header") return checked();
      if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
      Result<void> read = wrong("a line begins with " + shown(keyword), "comment, obj_info, element, property or end_header");
      if (keyword == "element") read = element(words);
      if (keyword == "property") read = property(words);
      if (!read) return read.problem();
    }
    return source_.short_line("the header");
  }

 private:
  /// Exactly one line: behind the last one binary data may begin with anything. False where the file ends first.
  bool next() {
    line_.clear();
    number_ = source_.line();
    for (int byte = source_.get(); byte != '\n'; byte = source_.get()) {
      if (byte == MeshSource::kEnd) return false;
      if (line_.size() < kLongestLine) line_.push_back(static_cast<char>(byte));
    }
    if (line_.ends_with('\r')) line_.pop_back();
    return true;
  }

  Problem wrong(const std::string& what, const std::string& accepted) const {
    return source_.invalid_line(number_, what, accepted);
  }

  Result<void> read_format() {
    std::istringstream words(line_);
    std::string keyword, format, version, rest;
    words >> keyword >> format >> version;
    const bool known = keyword == "format" && version == "1.0" && !(words >> rest);
    if (known && format == "ascii") return as(MeshFormat::ply_ascii);
    if (known && format == "binary_little_endian") return as(MeshFormat::ply_little_endian);
    if (known && format == "binary_big_endian") return as(MeshFormat::ply_big_endian);
    return wrong(shown(line_) + " is no format",
                 "format ascii 1.0, format binary_little_endian 1.0, format binary_big_endian 1.0");
  }
  Result<void> as(MeshFormat format) {
    header_.format = format;
    return {};
  }

  Result<void> element(std::istringstream& words) {
    PlyElement element;
    std::string count, rest;
    words >> element.name >> count;
    const auto read = signed_number<std::uint64_t>(count);
    if (!read || (words >> rest)) return wrong(shown(line_) + " is no element", "element NAME COUNT");
    element.count = *read;
    const bool wanted = element.name == "vertex" || element.name == "face";
    for (const PlyElement& other : header_.elements) {
      if (wanted && other.name == element.name) return wrong("there is an element " + element.name + " already", "one of them");
    }
    if (element.name == "vertex" && element.count > kMostVertices) {
      return wrong(count + " vertices are too many", "fewer than 2^32");
    }
    header_.elements.push_back(element);
    return {};
  }

  Result<void> property(std::istringstream& words) {
    if (header_.elements.empty()) return wrong("a property before the first element", "element NAME COUNT");
    PlyElement& element = header_.elements.back();
    PlyProperty property;
    std::string type, count, name, rest;
    words >> type;
    const bool list = type == "list";
    if (list) words >> count >> type;
    words >> name;
    const auto item = type_called(type), length = type_called(count);
    if (name.empty() || !item || (list && (!length || !is_whole(*length))) || (words >> rest)) {
      return wrong(shown(line_) + " is no property", "property TYPE NAME or property list TYPE TYPE NAME, lengths whole numbers");
    }
    property.type = *item;
    if (list) property.count = *length;
    property.role = role_of(element, property, name);
    for (const PlyProperty& other : element.properties) {
      if (property.role != PlyRole::skipped && other.role == property.role) {
        return wrong("there is a property " + name + " already", "one of them");
      }
    }
    if (property.role == PlyRole::corners && !is_whole(property.type)) return wrong("corners are " + type, "whole numbers");
    element.properties.push_back(property);
    return {};
  }

  static PlyRole role_of(const PlyElement& element, const PlyProperty& property, const std::string& name) {
    if (element.name == "vertex" && !property.count) {
      if (name == "x") return PlyRole::x;
      if (name == "y") return PlyRole::y;
      if (name == "z") return PlyRole::z;
    }
    const bool corners = name == "vertex_indices" || name == "vertex_index";
    return element.name == "face" && property.count && corners ? PlyRole::corners : PlyRole::skipped;
  }

  Result<PlyHeader> checked() {
    int axes = 0, corners = 0;
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") header_.vertices = element.count;
      if (element.name == "face") header_.triangles = element.count;
      for (const PlyProperty& property : element.properties) {
        corners += property.role == PlyRole::corners;
        if (property.role == PlyRole::skipped || property.role == PlyRole::corners) continue;
        ++axes;
        const bool fits = property.type == PlyType::float32 || size_of(property.type) < 4;
        if (!fits) header_.coordinates = CoordinateType::float64;
      }
    }
    if (axes != 3) return wrong("there is no element vertex with x, y and z", "element vertex, with the properties x, y, z");
    if (corners != 1) {
      return wrong("there is no element face with a list of corners", "element face, with a list vertex_indices or vertex_index");
    }
    return header_;
  }

  MeshSource& source_;
  PlyHeader header_;
  std::string line_;
  std::uint64_t number_ = 0;  // of line_
};

}  // namespace

std::size_t size_of(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

Result<PlyHeader> read_ply_header(MeshSource& source) { return PlyHeaderReader(source).read(); }

}  // namespace cordillera::proto
