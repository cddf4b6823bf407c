#include "gpu/waves/border/polygon_fill.h"

#include <algorithm>

namespace cordillera::gpu {
namespace {

constexpr int kMostSteps = 4000;

bool positive(const Polygon& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) { return twice_area(p, a, b, c) > 0; }

// What is still to be filled: the part of the polygon between two of its vertices, on the inner side of the line that joins them.
struct PolygonPart {
  std::uint32_t from = 0, to = 0;
};

class Search {
 public:
  Search(const Polygon& polygon, Diagonals& diagonals) : p_(polygon), found_(diagonals) {}

  Filled run() {
    found_.count = 0;
    open_[0] = {0, p_.count - 1};
    return fill(1) ? Filled::yes : Filled::no;
  }

 private:
  // The apex with most room comes first: valences stay even.
  std::uint32_t apexes(PolygonPart part, std::array<std::uint32_t, kRowWidth>& order) const {
    std::uint32_t count = 0;
    for (std::uint32_t k = part.from + 1; k < part.to; ++k)
      if (positive(p_, part.from, k, part.to)) order[count++] = k;
    std::stable_sort(order.begin(), order.begin() + count,
                     [&](std::uint32_t a, std::uint32_t b) { return p_.budget[a] > p_.budget[b]; });
    return count;
  }

  bool draw(std::uint32_t a, std::uint32_t b) {
    if (b == a + 1) return true;
    if (p_.budget[a] <= 0 || p_.budget[b] <= 0) return false;
    --p_.budget[a];
    --p_.budget[b];
    found_.at[found_.count++] = {static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b)};
    return true;
  }

  void undo(std::uint32_t count) {
    while (found_.count > count) {
      const Diagonal d = found_.at[--found_.count];
      ++p_.budget[d.from];
      ++p_.budget[d.to];
    }
  }

  // Fills the last of the waiting parts, then the rest.
  bool fill(std::uint32_t waiting) {
    if (waiting == 0) return true;
    if (++steps_ > kMostSteps) return false;
    const PolygonPart part = open_[waiting - 1];
    if (part.to == part.from + 1) {
      const bool rest = fill(waiting - 1);
      open_[waiting - 1] = part;
      return rest;
    }
    std::array<std::uint32_t, kRowWidth> order{};
    const std::uint32_t count = apexes(part, order);
    const std::uint32_t drawn = found_.count;
    for (std::uint32_t k = 0; k < count; ++k) {
      if (draw(part.from, order[k]) && draw(order[k], part.to)) {
        open_[waiting - 1] = {part.from, order[k]};
        open_[waiting] = {order[k], part.to};
        if (fill(waiting + 1)) return true;
      }
      undo(drawn);
    }
    open_[waiting - 1] = part;
    return false;
  }

  Polygon p_;
  Diagonals& found_;
  std::array<PolygonPart, 2 * kRowWidth> open_{};
  int steps_ = 0;
};

}  // namespace

Filled fill_from(const Polygon& polygon, std::uint32_t apex, Diagonals& diagonals) {
  const std::uint32_t n = polygon.count;
  if (polygon.budget[apex] < static_cast<std::int32_t>(n) - 3) return Filled::no;
  diagonals.count = 0;
  for (std::uint32_t step = 1; step + 1 < n; ++step) {
    const std::uint32_t a = (apex + step) % n, b = (apex + step + 1) % n;
    if (!positive(polygon, apex, a, b)) return Filled::no;
    if (step == 1) continue;
    if (polygon.budget[a] <= 0) return Filled::no;
    diagonals.at[diagonals.count++] = {static_cast<std::uint8_t>(std::min(apex, a)),
                                       static_cast<std::uint8_t>(std::max(apex, a))};
  }
  return Filled::yes;
}

Filled fill_any(const Polygon& polygon, Diagonals& diagonals) { return Search(polygon, diagonals).run(); }

}  // namespace cordillera::gpu
