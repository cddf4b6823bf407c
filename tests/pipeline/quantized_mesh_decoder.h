#pragma once
// quantized-mesh 1.0 read as its specification says, apart from the code that writes it.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "pipeline/encode/little_endian.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::testing {

struct DecodedTerrain {
  proto::Vec3 centre, sphere_centre, horizon;
  float low_m = 0, high_m = 0;
  double radius_m = 0;
  std::vector<std::array<int, 3>> vertices;  ///< u, v, h: 0 .. 32767
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::array<std::vector<std::uint32_t>, 4> sides;  ///< west, south, east, north
  std::vector<proto::Vec3> normals;
  std::vector<std::uint8_t> water;  ///< empty: it says nothing; one value, or 256 x 256 from the north-west

  double height_m(std::size_t v) const { return low_m + (double{high_m} - low_m) * vertices[v][2] / 32767; }
  /// Twice the area in plan, square quanta.
  std::int64_t twice_area(std::size_t t) const {
    const auto &a = vertices[triangles[t][0]], &b = vertices[triangles[t][1]], &c = vertices[triangles[t][2]];
    return std::int64_t{b[0] - a[0]} * (c[1] - a[1]) - std::int64_t{b[1] - a[1]} * (c[0] - a[0]);
  }
};

class TerrainReader {
 public:
  explicit TerrainReader(std::string_view bytes) : bytes_(bytes) {}

  DecodedTerrain read() {
    DecodedTerrain out;
    out.centre = vector();
    out.low_m = std::bit_cast<float>(take<std::uint32_t>());
    out.high_m = std::bit_cast<float>(take<std::uint32_t>());
    out.sphere_centre = vector();
    out.radius_m = real();
    out.horizon = vector();
    out.vertices.resize(take<std::uint32_t>());
    for (std::size_t k = 0; k < 3; ++k) {
      int value = 0;
      for (auto& vertex : out.vertices) {
        const auto code = take<std::uint16_t>();
        value += (code >> 1) ^ -(code & 1);
        vertex[k] = value;
      }
    }
    wide_ = out.vertices.size() > 65536;
    while (at_ % (wide_ ? 4 : 2) != 0) ++at_;
    out.triangles.resize(take<std::uint32_t>());
    std::uint32_t highest = 0;
    for (auto& triangle : out.triangles) {
      for (std::uint32_t& v : triangle) {
        const std::uint32_t code = index();
        v = highest - code;
        if (code == 0) ++highest;
      }
    }
    for (auto& side : out.sides) {
      side.resize(take<std::uint32_t>());
      for (std::uint32_t& v : side) v = index();
    }
    while (at_ < bytes_.size()) extension(out);
    return out;
  }

 private:
  template <class T>
  T take() {
    if (at_ + sizeof(T) > bytes_.size()) throw std::runtime_error("the tile is too short");
    at_ += sizeof(T);
    return little_endian_at<T>(bytes_, at_ - sizeof(T));
  }
  double real() { return std::bit_cast<double>(take<std::uint64_t>()); }
  proto::Vec3 vector() {
    const double x = real(), y = real(), z = real();
    return {x, y, z};
  }
  std::uint32_t index() { return wide_ ? take<std::uint32_t>() : take<std::uint16_t>(); }

  void extension(DecodedTerrain& out) {
    const auto id = take<std::uint8_t>();
    const auto length = take<std::uint32_t>();
    if (id == 2 && (length == 1 || length == 65536) && at_ + length <= bytes_.size()) {
      const std::string_view mask = bytes_.substr(at_, length);
      out.water.assign(mask.begin(), mask.end());
      at_ += length;
      return;
    }
    if (id != 1 || length != 2 * out.vertices.size()) throw std::runtime_error("an extension that was not announced");
    for (std::size_t v = 0; v < out.vertices.size(); ++v) {
      double x = take<std::uint8_t>() / 255.0 * 2 - 1, y = take<std::uint8_t>() / 255.0 * 2 - 1;
      const double z = 1 - std::abs(x) - std::abs(y);
      if (z < 0) {
        const double old = x;
        x = (1 - std::abs(y)) * (x < 0 ? -1 : 1);
        y = (1 - std::abs(old)) * (y < 0 ? -1 : 1);
      }
      const double length_of = std::sqrt(x * x + y * y + z * z);
      out.normals.push_back({x / length_of, y / length_of, z / length_of});
    }
  }

  std::string_view bytes_;
  std::size_t at_ = 0;
  bool wide_ = false;
};

}  // namespace cordillera::pipeline::testing
