#include "pipeline/check/border_laws.h"

namespace cordillera::pipeline::check {
namespace {

bool same(const proto::Vec3& a, const proto::Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

}  // namespace

void BorderLaws::compare(const proto::TileAddress& a, const std::vector<SideEdge>& of_a, const proto::TileAddress& b,
                         const std::vector<SideEdge>& of_b) {
  ++report_.borders;
  const std::string where = name_of(a) + " and " + name_of(b);
  for (std::size_t i = 0, j = 0; i < of_a.size() && j < of_b.size();) {
    const SideEdge &p = of_a[i], &q = of_b[j];
    if (p.from < q.to && q.from < p.to) {  // where only one has data there is nothing to share
      if (p.from != q.from || p.to != q.to) {
        report_.findings.add(where, "a vertex of one lies inside an edge of the other, near unit " +
                                        std::to_string(std::max(p.from, q.from)) + " of their common side");
        return;
      }
      if (p.from_height != q.from_height || p.to_height != q.to_height) {
        return report_.findings.add(where,
                                    "they have different heights at unit " + std::to_string(p.from) + " of their common side");
      }
      if (!same(p.from_point, q.from_point) || !same(p.to_point, q.to_point)) {
        return report_.findings.add(where,
                                    "their .glb points differ at unit " + std::to_string(p.from) + " of their common side");
      }
    }
    p.to <= q.to ? ++i : ++j;
  }
}

void BorderLaws::add(CheckedTile& tile) {
  if (tile.tile.y != row_) {
    end_row();
    if (tile.tile.y != row_ + 1) below_.clear();
    row_ = tile.tile.y;
  }
  now_[tile.tile.x] = std::move(tile.sides);
}

void BorderLaws::end_row() {
  const std::int32_t across = proto::tiles_across(level_);
  for (const auto& [x, sides] : now_) {
    const std::int32_t next = (x + 1) % across;
    if (const auto east = now_.find(next); east != now_.end())
      compare({level_, x, row_}, sides[kEast], {level_, next, row_}, east->second[kWest]);
    if (const auto south = below_.find(x); south != below_.end()) {
      compare({level_, x, row_ - 1}, south->second[kNorth], {level_, x, row_}, sides[kSouth]);
    }
  }
  below_ = std::move(now_);
  now_.clear();
}

}  // namespace cordillera::pipeline::check
