#pragma once
// The mesh in work: plan positions are integers, every vertex knows its ring of neighbours, triangles are implied.
#include <cstdint>

#include "gpu/device/bits.h"
#include "proto/host_device.h"

namespace cordillera::gpu::fit {

/// Most neighbours a vertex gets (the input may bring more). A row of so many is one line of a CPU's cache.
inline constexpr std::uint32_t kMostNeighbours = 16;

enum VertexFlag : std::uint8_t {
  kOpen = 1,  ///< on the border of the mesh
  kGone = 2,
  kFixed = 4,  ///< keeps its position and its height
};

/// A position in the plan, in units.
struct Point {
  std::int32_t x = 0, y = 0;
};

struct Vertex {
  std::int32_t x, y;  ///< units
  float z;            ///< scaled metres above the middle of the relief
  std::uint16_t valence;
  std::uint8_t flags;
  std::uint8_t steep;  ///< class of the steepest edge that it may have, see edges_rise_to; 0: any

  CORDILLERA_HD Point at() const { return {x, y}; }
  CORDILLERA_HD bool open() const { return (flags & kOpen) != 0; }
  CORDILLERA_HD bool gone() const { return (flags & kGone) != 0; }
  CORDILLERA_HD bool fixed() const { return (flags & kFixed) != 0; }
  /// Triangles around it.
  CORDILLERA_HD std::uint32_t triangles() const { return valence - std::uint32_t{open()}; }
};

/// Row v holds the neighbours of v counter-clockwise, an open one from border to border; triangle i of v is (v, row[i], row[i +
/// 1]).
struct FitMesh {
  Vertex* vertex = nullptr;
  std::uint32_t* rows = nullptr;
  int row_shift = 4;  ///< a row has 1 << row_shift places
  float cells_per_unit = 1;
  float units_per_cell = 1;

  CORDILLERA_HD std::uint32_t* row(std::uint32_t v) const { return rows + (std::size_t{v} << row_shift); }
  CORDILLERA_HD std::uint32_t next(const Vertex& v, std::uint32_t i) const { return i + 1 == v.valence ? 0 : i + 1; }
};

/// Twice the area of a triangle, positive if counter-clockwise.
CORDILLERA_HD inline std::int64_t turn(Point a, Point b, Point c) {
  return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) - (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

/// The triangles of v: visit(a, b) with their other corners, counter-clockwise, until it returns false.
template <class Visit>
CORDILLERA_HD bool each_triangle(const FitMesh& mesh, std::uint32_t v, const Visit& visit) {
  const std::uint32_t* const row = mesh.row(v);
  const std::uint32_t valence = mesh.vertex[v].valence;
  const Vertex first = mesh.vertex[row[0]];
  Vertex a = first;
  for (std::uint32_t i = 1; i < valence; ++i) {
    const Vertex b = mesh.vertex[row[i]];
    if (!visit(a, b)) return false;
    a = b;
  }
  return mesh.vertex[v].open() || visit(a, first);
}

/// Does the border run straight through v?
CORDILLERA_HD inline bool is_straight(const FitMesh& mesh, std::uint32_t v) {
  const Vertex& at = mesh.vertex[v];
  if (at.fixed()) return false;
  const Vertex& from = mesh.vertex[mesh.row(v)[0]];
  const Vertex& to = mesh.vertex[mesh.row(v)[at.valence - 1]];
  if (turn(from.at(), at.at(), to.at()) != 0) return false;
  const std::int64_t ahead =
      (std::int64_t{at.x} - from.x) * (std::int64_t{to.x} - at.x) + (std::int64_t{at.y} - from.y) * (std::int64_t{to.y} - at.y);
  return ahead > 0;
}

/// Edges of the class rise by at most twice so much a unit of the plan as the steepest one of the input did at the vertex, or at
/// those that it has come to stand for: on a plane an edge may run straighter up than those before it. Classes are octaves.
inline constexpr int kLevelClass = 128, kLeastSteep = 1, kMostSteep = 190;
CORDILLERA_HD inline float edges_rise_to(std::uint8_t steep) {
  constexpr std::uint32_t kFloatBias = 127, kMantissa = 23;
  return bits_float(static_cast<std::uint32_t>(steep - kLevelClass + 1 + static_cast<int>(kFloatBias)) << kMantissa);
}

/// May there be an edge between them? Where no sample is, nothing else keeps a vertex from spiking.
CORDILLERA_HD inline bool may_see(const Vertex& a, const Vertex& b) {
  constexpr float kFlat = 4e-3f;  // scaled heights are floats
  const std::uint8_t steep = a.steep > b.steep ? a.steep : b.steep;
  if (a.steep == 0 || b.steep == 0) return true;
  const float dx = static_cast<float>(b.x - a.x), dy = static_cast<float>(b.y - a.y), dz = b.z - a.z, rise = edges_rise_to(steep);
  return dz * dz <= rise * rise * (dx * dx + dy * dy) + kFlat * kFlat;
}

CORDILLERA_HD inline std::int32_t nearest(float value) {
  return static_cast<std::int32_t>(value < 0 ? value - 0.5f : value + 0.5f);
}

}  // namespace cordillera::gpu::fit
