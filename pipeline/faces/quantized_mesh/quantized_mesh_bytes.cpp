#include "pipeline/faces/quantized_mesh/quantized_mesh_bytes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pipeline/encode/little_endian.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::uint8_t kNormalsExtension = 1, kWaterExtension = 2;

void append(std::string& out, float value) { append_little_endian(out, std::bit_cast<std::uint32_t>(value)); }
void append(std::string& out, const proto::Vec3& v) {
  for (const double value : {v.x, v.y, v.z}) append_little_endian(out, value);
}

/// Heights are the tile's lowest plus h / 32767 of its range. Both are multiples of the level's step or of a half, a quarter, …
/// of it, so every height is exact; the range is the least such that holds the tile, for clients take it for the tile's real one.
struct Heights {
  std::int32_t low = 0;  // in the level's steps
  int finer = 0;         // halvings of the step

  Heights(const QuantizedSurface& surface) {
    std::int32_t high = low = surface.vertices[0].height;
    for (const auto& vertex : surface.vertices) {
      low = std::min(low, vertex.height);
      high = std::max(high, vertex.height);
    }
    while (std::ldexp(surface.step_m, -finer) > proto::kHeightStep_m &&
           (std::int64_t{high - low} << (finer + 1)) <= kMostQuanta) {
      ++finer;
    }
  }
};

void append_header(std::string& out, const QuantizedSurface& surface, const Heights& heights) {
  const std::vector<proto::Vec3> at = positions(surface);
  const QuantizedBounds bounds = quantized_bounds(surface, at);
  const double low_m = heights.low * surface.step_m;
  append(out, bounds.centre);
  append(out, static_cast<float>(low_m));
  append(out, static_cast<float>(low_m + kMostQuanta * std::ldexp(surface.step_m, -heights.finer)));
  append(out, bounds.centre);
  append_little_endian(out, bounds.radius_m);
  append(out, bounds.horizon);
}

template <class Value>
void append_differences(std::string& out, const QuantizedSurface& surface, const Value& value) {
  std::int32_t before = 0;
  for (const auto& vertex : surface.vertices) {
    const std::int32_t now = value(vertex), difference = now - before;
    append_little_endian(out, static_cast<std::uint16_t>((difference << 1) ^ (difference >> 31)));
    before = now;
  }
}

void append_index(std::string& out, std::uint32_t index, bool wide) {
  if (wide) {
    append_little_endian(out, index);
  } else
    append_little_endian(out, static_cast<std::uint16_t>(index));
}

/// A new vertex is 0, others count back from it.
void append_triangles(std::string& out, const QuantizedSurface& surface, bool wide) {
  std::uint32_t fresh = 0;
  append_little_endian(out, static_cast<std::uint32_t>(surface.triangles.size()));
  for (const Triangle& t : surface.triangles) {
    for (const std::uint32_t v : t) {
      append_index(out, fresh - v, wide);
      if (v == fresh) ++fresh;
    }
  }
}

/// Q. Meyer et al., "On floating-point normal vectors", 2010: the sphere folded onto a square.
std::array<std::uint8_t, 2> folded(const proto::Vec3& n) {
  const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  double x = n.x / sum, y = n.y / sum;
  if (n.z < 0) {
    const double across = (1 - std::abs(y)) * (x < 0 ? -1 : 1), up = (1 - std::abs(x)) * (y < 0 ? -1 : 1);
    x = across;
    y = up;
  }
  const auto byte = [](double value) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(value * 0.5 + 0.5, 0.0, 1.0) * 255));
  };
  return {byte(x), byte(y)};
}

void append_normals(std::string& out, const QuantizedSurface& surface) {
  append_little_endian(out, kNormalsExtension);
  append_little_endian(out, static_cast<std::uint32_t>(2 * surface.vertices.size()));
  for (const auto& vertex : surface.vertices) {
    for (const std::uint8_t byte : folded(vertex.normal)) append_little_endian(out, byte);
  }
}

/// One byte where a tile is all land or all water.
void append_water(std::string& out, const WaterPixels& water) {
  const std::uint8_t first = water.empty() ? 0 : water[0];
  const bool one =
      (first == 0 || first == kWater) && std::all_of(water.begin(), water.end(), [&](std::uint8_t p) { return p == first; });
  append_little_endian(out, kWaterExtension);
  append_little_endian(out, static_cast<std::uint32_t>(one ? 1 : water.size()));
  if (one) {
    append_little_endian(out, first);
  } else {
    out.append(water.begin(), water.end());
  }
}

}  // namespace

std::string quantized_mesh_bytes(const QuantizedSurface& surface, const WaterPixels* water) {
  const Heights heights(surface);
  const bool wide = surface.vertices.size() > 65536;
  std::string out;
  append_header(out, surface, heights);
  append_little_endian(out, static_cast<std::uint32_t>(surface.vertices.size()));
  append_differences(out, surface, [](const auto& vertex) { return vertex.u; });
  append_differences(out, surface, [](const auto& vertex) { return vertex.v; });
  append_differences(out, surface, [&](const auto& vertex) { return (vertex.height - heights.low) << heights.finer; });
  pad(out, wide ? 4 : 2, '\0');
  append_triangles(out, surface, wide);
  for (const auto& side : surface.sides) {
    append_little_endian(out, static_cast<std::uint32_t>(side.size()));
    for (const std::uint32_t v : side) append_index(out, v, wide);
  }
  append_normals(out, surface);
  if (water != nullptr) append_water(out, *water);
  return out;
}

std::string quantized_mesh_tile(const MeshGrid& grid, const proto::TileAddress& tile) {
  const QuantizedSurface surface = quantized_surface(grid, tile);
  if (!has_water(grid.terrain().manifest().options())) return quantized_mesh_bytes(surface, nullptr);
  const WaterPixels water = grid.water(tile);
  return quantized_mesh_bytes(surface, &water);
}

proto::Result<std::optional<Document>> quantized_mesh_document(const MeshGrid& grid, const proto::TileAddress& tile) {
  if (!has_quantized_tile(grid, tile)) return std::optional<Document>();
  return std::optional(document(quantized_mesh_tile(grid, tile)));
}

}  // namespace cordillera::pipeline::faces
