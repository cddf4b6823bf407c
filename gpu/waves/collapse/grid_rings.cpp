#include "gpu/waves/collapse/grid_rings.h"

#include <cmath>

namespace cordillera::gpu {

std::int32_t grid_cells(const proto::TileMesh& mesh) {
  const auto across = static_cast<std::int32_t>(std::lround(std::sqrt(static_cast<double>(mesh.vertices()))));
  const std::int32_t cells = across - 1;
  if (cells < 1 || static_cast<std::size_t>(across) * across != mesh.vertices()) return 0;
  if (mesh.side % cells != 0 || mesh.triangles.size() != 2 * static_cast<std::size_t>(cells) * cells) return 0;
  const std::int32_t step = mesh.side / cells;
  const std::array<std::uint32_t, 3>* triangle = mesh.triangles.data();
  std::uint32_t differ = 0;  // one look a row: branches would cost more than the comparisons
  for (std::int32_t j = 0; j < across && differ == 0; ++j) {
    const auto start = static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(across);
    for (std::int32_t i = 0; i < across; ++i) {
      differ |= static_cast<std::uint32_t>((mesh.x[start + i] ^ i * step) | (mesh.y[start + i] ^ j * step));
    }
    if (j == cells) break;
    for (std::int32_t i = 0; i < cells; ++i, triangle += 2) {
      const std::uint32_t sw = start + static_cast<std::uint32_t>(i), ne = sw + static_cast<std::uint32_t>(across) + 1;
      differ |= (triangle[0][0] ^ sw) | (triangle[0][1] ^ (sw + 1)) | (triangle[0][2] ^ ne);
      differ |= (triangle[1][0] ^ sw) | (triangle[1][1] ^ ne) | (triangle[1][2] ^ (ne - 1));
    }
  }
  return differ ? 0 : cells;
}

}  // namespace cordillera::gpu
