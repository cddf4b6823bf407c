// PLY after its header. Text and binary rows are the same walk over properties; only how a value is fetched differs.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "proto/mesh_file/formats.h"
#include "proto/mesh_file/ply_header.h"

namespace cordillera::proto {
namespace {

/// Values of ascii rows: a row a line.
class AsciiValues {
 public:
  AsciiValues(MeshSource& source, MeshFormat) : source_(source), lines_(source, 0, 0) {}

  bool next_row() { return lines_.next(); }
  bool row_ended() { return lines_.word().empty(); }
  /// The next value; nothing if there is none of that type.
  std::optional<double> value(PlyType type) {
    const std::string_view word = lines_.word();
    // Of text a float is the nearest float, not the nearest double made a float.
    if (type == PlyType::float32) {
      const auto read = signed_number<float>(word);
      return read ? std::optional<double>(*read) : std::nullopt;
    }
    return signed_number<double>(word);
  }
  bool skip(PlyType type, std::uint64_t count) {
    for (; count > 0; --count) {
      if (!value(type)) return false;
    }
    return true;
  }
  Problem wrong(const std::string& what, const std::string& accepted) const {
    return source_.invalid_line(lines_.line(), what, accepted);
  }
  Problem ended(const std::string& what) const { return source_.short_line(what); }
  /// A value that is not there.
  Problem missing(const std::string& what) const {
    return wrong(what + " has a word too few or one that is no such number", "the values that the header names, a row on a line");
  }
  bool at_end() { return !lines_.next(); }

 private:
  MeshSource& source_;
  TextLines lines_;
};

/// Values of binary rows: one behind the other.
class BinaryValues {
 public:
  BinaryValues(MeshSource& source, MeshFormat format)
      : source_(source), swapped_((format == MeshFormat::ply_big_endian) != (std::endian::native == std::endian::big)) {}

  bool next_row() {
    row_ = source_.byte();
    return true;
  }
  bool row_ended() { return true; }
  std::optional<double> value(PlyType type) {
    switch (type) {
      case PlyType::int8: return fetched<std::int8_t>();
      case PlyType::uint8: return fetched<std::uint8_t>();
      case PlyType::int16: return fetched<std::int16_t>();
      case PlyType::uint16: return fetched<std::uint16_t>();
      case PlyType::int32: return fetched<std::int32_t>();
      case PlyType::uint32: return fetched<std::uint32_t>();
      case PlyType::float32: return fetched<float>();
      case PlyType::float64: break;
    }
    return fetched<double>();
  }
  bool skip(PlyType type, std::uint64_t count) { return source_.skip(count * size_of(type)); }
  Problem wrong(const std::string& what, const std::string& accepted) const { return source_.invalid_byte(row_, what, accepted); }
  Problem ended(const std::string& what) const { return source_.short_byte(what); }
  Problem missing(const std::string& what) const { return ended(what); }
  bool at_end() {
    row_ = source_.byte();
    return source_.peek() == MeshSource::kEnd;
  }

 private:
  template <class T>
  std::optional<double> fetched() {
    std::array<char, sizeof(T)> bytes{};
    if (!source_.read(bytes.data(), bytes.size())) return std::nullopt;
    if (swapped_) std::reverse(bytes.begin(), bytes.end());
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  MeshSource& source_;
  bool swapped_;
  std::uint64_t row_ = 0;
};

template <class Values>
class PlyReader {
 public:
  PlyReader(MeshSource& source, const PlyHeader& header) : source_(source), header_(header), values_(source, header.format) {}

  Result<MeshFile> read() {
    file_.encoding = {header_.format, header_.coordinates};
    for (auto* axis : {&file_.mesh.x, &file_.mesh.y, &file_.mesh.z}) axis->reserve(source_.room_for(header_.vertices));
    file_.mesh.triangles.reserve(source_.room_for(header_.triangles));
    for (const PlyElement& element : header_.elements) {
      // Such rows have no bytes, and as text no more than an empty line.
      if (element.properties.empty()) continue;
      for (std::uint64_t row = 0; row < element.count; ++row) {
        if (auto read = read_row(element, row); !read) return read.problem();
      }
    }
    if (!values_.at_end()) {
      return values_.wrong("the file goes on after its last element", "nothing after the elements that were announced");
    }
    return std::move(file_);
  }

 private:
  static std::string place(const PlyElement& element, std::uint64_t row) {
    return element.name + " " + std::to_string(row) + " of " + std::to_string(element.count);
  }

  Result<void> read_row(const PlyElement& element, std::uint64_t row) {
    if (!values_.next_row()) return values_.ended(place(element, row));
    for (const PlyProperty& property : element.properties) {
      auto read = property.count ? list(element, property, row) : scalar(element, property, row);
      if (!read) return read;
    }
    if (!values_.row_ended()) {
      return values_.wrong(place(element, row) + " has a word too many", "the values that the header names, a row on a line");
    }
    return {};
  }

  Result<void> scalar(const PlyElement& element, const PlyProperty& property, std::uint64_t row) {
    if (property.role == PlyRole::skipped) {
      if (!values_.skip(property.type, 1)) return values_.missing(place(element, row));
      return {};
    }
    const auto value = values_.value(property.type);
    if (!value) return values_.missing(place(element, row));
    if (!std::isfinite(*value)) return values_.wrong(place(element, row) + " has a coordinate that is not finite", kFiniteNumber);
    TriangleMesh& mesh = file_.mesh;
    (property.role == PlyRole::x ? mesh.x : property.role == PlyRole::y ? mesh.y : mesh.z).push_back(*value);
    return {};
  }

  Result<void> list(const PlyElement& element, const PlyProperty& property, std::uint64_t row) {
    const auto length = values_.value(*property.count);
    if (!length) return values_.missing(place(element, row));
    if (!(*length >= 0) || *length != std::floor(*length) || *length > 0xffffffff) {
      return values_.wrong(place(element, row) + " has a list whose length is no count", "a length from 0 on");
    }
    const auto count = static_cast<std::uint64_t>(*length);
    if (property.role == PlyRole::skipped) {
      if (!values_.skip(property.type, count)) return values_.missing(place(element, row));
      return {};
    }
    if (count != 3) {
      return values_.wrong("polygon " + std::to_string(row) + " has " + std::to_string(count) + " corners", kOnlyTriangles);
    }
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& corner : triangle) {
      const auto index = values_.value(property.type);
      if (!index) return values_.missing(place(element, row));
      if (*index != std::floor(*index)) {
        return values_.wrong(place(element, row) + " has a corner that is no whole number", "a vertex from 0 on");
      }
      if (!(*index >= 0 && *index < static_cast<double>(header_.vertices))) {
        return values_.wrong(out_of_range(row, *index, header_.vertices), "");
      }
      corner = static_cast<std::uint32_t>(*index);
    }
    file_.mesh.triangles.push_back(triangle);
    return {};
  }

  MeshSource& source_;
  const PlyHeader& header_;
  Values values_;
  MeshFile file_;
};

}  // namespace

Result<MeshFile> read_ply(MeshSource& source) {
  const auto header = read_ply_header(source);
  if (!header) return header.problem();
  if (header->format == MeshFormat::ply_ascii) return PlyReader<AsciiValues>(source, *header).read();
  return PlyReader<BinaryValues>(source, *header).read();
}

}  // namespace cordillera::proto
