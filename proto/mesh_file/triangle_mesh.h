#pragma once
// A triangle mesh as files of other programs have it: any coordinates, no lattice.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cordillera::proto {

struct TriangleMesh {
  std::vector<double> x, y, z;                          ///< indexed by vertex, all of one length; finite; units are the file's
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices from 0; a reader lets no index through that is out of range

  std::size_t vertices() const { return x.size(); }
};

}  // namespace cordillera::proto
