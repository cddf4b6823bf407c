#pragma once
// A height mesh as the fit takes it: plan positions as integers, heights as floats about the middle of the relief, the vertices
// in an order in which neighbours lie near each other, and the same vertices as samples.
#include <array>
#include <vector>

#include "gpu/fit/simplify_height_mesh.h"
#include "gpu/fit/steps/samples.h"

namespace cordillera::gpu::fit {

/// From the input's coordinates to units and back. The scale of heights is a power of two: no bit is lost.
struct PlanScale {
  double x0 = 0, y0 = 0, unit_x = 1, unit_y = 1;
  double middle_z = 0, scale_z = 1;  ///< scaled height = (z - middle_z) * scale_z, within some 4096

  float height(double z) const { return static_cast<float>((z - middle_z) * scale_z); }
  void set_heights(double low, double high);
};

struct Plan {
  PlanScale scale;
  float units_per_cell = 16;
  std::vector<Point> at;                                ///< indexed by vertex
  std::vector<float> z;                                 ///< likewise, scaled
  std::vector<std::uint8_t> steep;                      ///< likewise, Vertex::steep; of lattices none
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise

  /// Vertices in runs that lie near each other: indexed by run, one more at the end, the first vertex in it. Lattices only.
  std::vector<std::uint32_t> block_start;

  /// The samples of a lattice, row-major; columns = 0: the vertices are no lattice, and sample i is vertex i.
  std::int32_t columns = 0, rows = 0;
  std::vector<float> lattice_z;
  /// Else the bins of the vertices: indexed by bin, one more at the end, the first vertex in it.
  std::vector<std::uint32_t> bin_start;
  std::int32_t bin_columns = 0, bin_rows = 0;
  int bin_shift = 0;
  double bin_company = 0;  ///< vertices that a vertex shares its bin with, on average

  bool is_lattice() const { return columns > 0; }
  Point point_of_sample(std::uint32_t i) const {
    return is_lattice() ? LatticeSamples{nullptr, nullptr, columns, rows}.at(i) : at[i];
  }
};

/// Of a mesh that check_height_mesh() accepted.
Plan make_plan(const HeightMesh& mesh, bool clockwise);

}  // namespace cordillera::gpu::fit
