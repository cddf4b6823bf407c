#pragma once
// The rings of the regular grid of grid_mesh() are arithmetic: no triangle needs to be looked at.
#include <cstdint>

#include "gpu/mesh/rings.h"
#include "proto/host_device.h"

namespace cordillera::gpu {

/// Cells along a side if mesh is, vertex for vertex and triangle for triangle, what grid_mesh() makes; else 0.
std::int32_t grid_cells(const proto::TileMesh& mesh);

/// The row of vertex (column, row) of a grid of cells x cells whose south-western vertex is `first`, in the order that rings.h
/// asks for. Returns the valence.
CORDILLERA_HD inline int grid_ring(std::int32_t cells, std::int32_t column, std::int32_t row, std::uint32_t first,
                                   std::uint32_t* ring) {
  // Counter-clockwise from the south-west, the lowest neighbour of an inner vertex; diagonals run south-west to north-east.
  const std::uint32_t across = static_cast<std::uint32_t>(cells) + 1;
  if (column > 0 && row > 0 && column < cells && row < cells) {
    const std::uint32_t v = first + static_cast<std::uint32_t>(row) * across + static_cast<std::uint32_t>(column);
    ring[0] = v - across - 1;
    ring[1] = v - across;
    ring[2] = v + 1;
    ring[3] = v + across + 1;
    ring[4] = v + across;
    ring[5] = v - 1;
    return 6;
  }
  const int dx[6] = {-1, 0, 1, 1, 0, -1}, dy[6] = {-1, -1, 0, 1, 1, 0};
  unsigned inside = 0;
  for (int k = 0; k < 6; ++k) {
    const std::int32_t x = column + dx[k], y = row + dy[k];
    if (x >= 0 && y >= 0 && x <= cells && y <= cells) inside |= 1u << k;
  }
  // An open fan starts at the neighbour that follows none.
  int from = 0;
  for (int k = 0; k < 6; ++k) {
    if (((inside >> k) & 1u) && !((inside >> (k + 5) % 6) & 1u)) from = k;
  }
  int valence = 0;
  for (int n = 0; n < 6; ++n) {
    const int k = (from + n) % 6;
    if ((inside >> k) & 1u) ring[valence++] = first + static_cast<std::uint32_t>((row + dy[k]) * (cells + 1) + column + dx[k]);
  }
  return valence;
}

}  // namespace cordillera::gpu
