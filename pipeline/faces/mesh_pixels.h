#pragma once
// A tile's mesh under a grid of pixels: each triangle is walked once, and its plane asked at the centres that it covers.
#include <span>
#include <vector>

#include "pipeline/encode/draco_mesh.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// Centres of pixels, sorted: longitudes eastward, latitudes southward.
struct PixelRows {
  std::vector<double> latitude_deg;
  std::vector<proto::RowFrame> frame;  ///< indexed like latitude_deg
};
struct PixelColumns {
  std::span<const double> longitude_deg;      ///< within [-180, 180]
  std::span<const proto::ColumnFrame> frame;  ///< indexed like longitude_deg
};

/// The same where the pixels are known in the mesh's own units from its south-west: they may lie on its sides to the bit.
struct PixelsInUnits {
  std::vector<double> u, v;                     ///< of columns, growing; of rows, falling
  std::span<const proto::RowFrame> rows;        ///< indexed like v
  std::span<const proto::ColumnFrame> columns;  ///< indexed like u
};

/// What parallels and meridians share at any place, not only on a lattice.
proto::RowFrame row_frame_at(double latitude_deg);
proto::ColumnFrame column_frame_at(double longitude_deg);

/// Puts heights above the ellipsoid, in metres, into pixels that are not a number yet and lie over the mesh. The pixel of row r
/// and column c is out[r * stride + c].
void draw_mesh(const LatticeMesh& mesh, const PixelRows& rows, const PixelColumns& columns, double* out, std::size_t stride);
void draw_mesh(const LatticeMesh& mesh, const PixelsInUnits& pixels, double* out, std::size_t stride);

}  // namespace cordillera::pipeline::faces
