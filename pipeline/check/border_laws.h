#pragma once
// Neighbours of one level share every vertex of their common edge. Tiles come in order, by y, then by x; two rows of sides are
// kept.
#include <map>

#include "pipeline/check/tile_laws.h"

namespace cordillera::pipeline::check {

class BorderLaws {
 public:
  BorderLaws(int level, Report& report) : level_(level), report_(report) {}
  /// y never falls. Takes the tile's sides.
  void add(CheckedTile& tile);
  /// After the last one.
  void finish() { end_row(); }

 private:
  using Sides = std::array<std::vector<SideEdge>, 4>;
  void end_row();
  void compare(const proto::TileAddress& a, const std::vector<SideEdge>& of_a, const proto::TileAddress& b,
               const std::vector<SideEdge>& of_b);

  int level_;
  Report& report_;
  std::int32_t row_ = -2;
  std::map<std::int32_t, Sides> below_, now_;  ///< by column
};

}  // namespace cordillera::pipeline::check
