#include "gpu/exact/strip.h"

#include <algorithm>
#include <stdexcept>
#include <unordered_map>

namespace cordillera::gpu::exact {
namespace {

/// Of the chain, between two vertices of the hem that stay; and of a row, for one vertex of the row before it.
constexpr int kChainPerHem = 4, kRowPerRow = 8;

/// Places along a side and inwards from it: s from south or west, t from the side.
class SideFrame {
 public:
  SideFrame(const StripSides& sides, int side) : sides_(sides), side_(side) {}

  bool along_x() const { return side_ == kSouth || side_ == kNorth; }
  int length() const { return (along_x() ? sides_.columns : sides_.rows) - 1; }
  int depth() const { return (along_x() ? sides_.rows : sides_.columns) - 1; }
  /// Are s and t, in this order, a left-handed pair?
  bool mirrored() const { return side_ == kNorth || side_ == kWest; }
  /// The row of the chain that is t rows inside of the side.
  int row(int t) const { return kSideReach + (side_ == kSouth || side_ == kWest ? t : -t); }
  std::uint32_t position(int s, int t) const {
    const int across = side_ == kSouth || side_ == kWest ? t : depth() - t;
    return along_x() ? pack_position(s, across) : pack_position(across, s);
  }
  int s_of(std::uint32_t position) const { return along_x() ? position_x(position) : position_y(position); }
  int t_of(std::uint32_t position) const {
    const int across = along_x() ? position_y(position) : position_x(position);
    return side_ == kSouth || side_ == kWest ? across : depth() - across;
  }
  bool shared_at_start() const { return sides_.shared[along_x() ? kWest : kSouth]; }
  bool shared_at_end() const { return sides_.shared[along_x() ? kEast : kNorth]; }
  int first(int t) const { return shared_at_start() ? t : 0; }
  int last(int t) const { return length() - (shared_at_end() ? t : 0); }
  bool on_tile_line(int s, const LevelRules& rules) const {
    return (((along_x() ? sides_.lattice_x : sides_.lattice_y) + s) & (rules.tile_side - 1)) == 0;
  }

 private:
  const StripSides& sides_;
  const int side_;
};

struct RowVertex {
  int s;
  std::uint32_t vertex;
};
using Row = std::vector<RowVertex>;

/// At a corner of a triangle: the other two, counter-clockwise.
struct Wedge {
  std::uint32_t vertex, from, to;
  auto operator<=>(const Wedge&) const = default;
};

std::vector<RowVertex> hem_of(const SideFrame& frame, std::span<const RingedVertex> hem) {
  Row row;
  for (const RingedVertex& v : hem) {
    if (frame.t_of(v.position) == kHemRow) row.push_back({frame.s_of(v.position), v.vertex});
  }
  std::sort(row.begin(), row.end(), [](const RowVertex& a, const RowVertex& b) { return a.s < b.s; });
  return row;
}

class StripMaker {
 public:
  StripMaker(const StripSides& sides, std::span<const RingedVertex> hem, std::uint32_t own, const LevelRules& rules)
      : sides_(sides), hem_(hem), own_(own), rules_(rules), step_(static_cast<std::int32_t>(rules.height_step)) {}

  Strip make() {
    for (const RingedVertex& v : hem_) {
      for (int k = 0; k + 1 < v.valence; ++k) wedges_.push_back({v.vertex, v.ring[k], v.ring[k + 1]});
    }
    for (int side = 0; side < 4; ++side) {
      if (sides_.shared[static_cast<std::size_t>(side)]) make_side(side);
    }
    std::ranges::sort(wedges_);
    for (RingedVertex& v : strip_.added) take_ring(v);
    for (const RingedVertex& v : hem_) {
      strip_.hem.push_back(v);
      strip_.hem.back().mark = static_cast<std::uint8_t>(v.mark & ~(kHeld | kSettled));
      take_ring(strip_.hem.back());
    }
    return std::move(strip_);
  }

 private:
  void make_side(int side) {
    const SideFrame frame(sides_, side);
    const SideChain& chain = sides_.chain[static_cast<std::size_t>(side)];
    std::array<Row, kHemRow + 1> rows;
    rows[kHemRow] = hem_of(frame, hem_);
    std::array<std::vector<int>, kHemRow> places = places_of_rows(chain, rows[kHemRow]);
    for (int t = 0; t < kHemRow; ++t) {
      const auto add = [&](int s) { rows[static_cast<std::size_t>(t)].push_back({s, vertex_at(side, frame, s, t)}); };
      // At a corner between two shared sides a row begins in a sample that both sides know, and one step on it is on its chord.
      const bool starts = t > 0 && frame.shared_at_start(), ends = t > 0 && frame.shared_at_end();
      const int first = frame.first(t) + (starts ? 2 : 0), last = frame.last(t) - (ends ? 2 : 0);
      if (starts) add(frame.first(t)), add(frame.first(t) + 1);
      for (const int s : places[static_cast<std::size_t>(t)]) {
        if (s >= first && s <= last) add(s);
      }
      if (ends) add(frame.last(t) - 1), add(frame.last(t));
    }
    for (std::size_t t = 0; t < kHemRow; ++t) zip(frame, rows[t], rows[t + 1]);
  }

  /// Rows have vertices where the chain has; and, from the hem outwards, for every eighth of the row before that lie between two
  /// of those.
  std::array<std::vector<int>, kHemRow> places_of_rows(const SideChain& chain, const Row& hem) const {
    std::array<std::vector<int>, kHemRow> places;
    std::vector<int> before;
    for (const RowVertex& v : hem) before.push_back(v.s);
    for (std::size_t t = kHemRow - 1; t > 0; --t) {
      std::vector<int> row = chain.place;
      int since = 0;
      std::size_t next = 0;
      for (const int s : before) {
        for (; next < chain.place.size() && chain.place[next] <= s; ++next) since = 0;
        if (next > 0 && chain.place[next - 1] == s) continue;
        if (++since < kRowPerRow) continue;
        row.push_back(s);
        since = 0;
      }
      std::sort(row.begin(), row.end());
      before = places[t] = row;
    }
    places[0] = chain.place;
    return places;
  }

  std::uint32_t vertex_at(int side, const SideFrame& frame, int s, int t) {
    const std::uint32_t position = frame.position(s, t);
    const auto [known, is_new] = numbers_.try_emplace(position, own_ + static_cast<std::uint32_t>(strip_.added.size()));
    if (!is_new) return known->second;
    const SideSamples& samples = sides_.samples[static_cast<std::size_t>(side)];
    const int row = frame.row(t);
    RingedVertex v;
    v.vertex = known->second;
    v.position = position;
    v.mark = static_cast<std::uint8_t>(t == 0 ? kHeld : 0);
    const bool in_corner =
        t > 0 && ((s == frame.first(t) && frame.shared_at_start()) || (s == frame.last(t) && frame.shared_at_end()));
    if (samples.is_void(row, s))
      v.mark |= kVoidVertex;
    else if (in_corner)
      v.height = rounded_to(static_cast<float>(samples.height(row, s)), rules_.height_step);
    else
      v.height = static_cast<float>(sides_.chain[static_cast<std::size_t>(side)].height_at(row, s, samples.bend, step_));
    strip_.added.push_back(v);
    return v.vertex;
  }

  /// Triangles between two rows. What one row has between two vertices of the other is shared out by number, not by distance,
  /// lest one vertex get all.
  void zip(const SideFrame& frame, const Row& outer, const Row& inner) {
    std::vector<int> both;
    for (const Row* row : {&outer, &inner}) {
      for (const RowVertex& v : *row) both.push_back(v.s);
    }
    std::sort(both.begin(), both.end());
    both.erase(std::unique(both.begin(), both.end()), both.end());
    const auto rank = [&both](const RowVertex& v) { return std::lower_bound(both.begin(), both.end(), v.s) - both.begin(); };
    std::size_t i = 0, j = 0;
    while (i + 1 < outer.size() || j + 1 < inner.size()) {
      if (outer_goes_on(frame, outer, i, inner, j, rank)) {
        triangle(frame, outer[i].vertex, outer[i + 1].vertex, inner[j].vertex);
        ++i;
      } else {
        triangle(frame, outer[i].vertex, inner[j + 1].vertex, inner[j].vertex);
        ++j;
      }
    }
  }
  template <class Rank>
  bool outer_goes_on(const SideFrame& frame, const Row& outer, std::size_t i, const Row& inner, std::size_t j,
                     const Rank& rank) const {
    if (j + 1 == inner.size()) return true;
    if (i + 1 == outer.size()) return false;
    // A corner between shared sides has no neighbour within but the corner of the next row.
    if (outer.size() > 2 && i == 0 && frame.shared_at_start()) return true;
    if (outer.size() > 2 && i + 2 == outer.size() && frame.shared_at_end()) return false;
    // Lines between tiles are lines of the strip.
    if (outer[i].s > inner[j].s && frame.on_tile_line(outer[i].s, rules_)) return false;
    if (inner[j].s > outer[i].s && frame.on_tile_line(inner[j].s, rules_)) return true;
    const auto along_outer = rank(outer[i]) + rank(outer[i + 1]), along_inner = rank(inner[j]) + rank(inner[j + 1]);
    return along_outer < along_inner || (along_outer == along_inner && outer[i].s < inner[j].s);
  }
  void triangle(const SideFrame& frame, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (frame.mirrored()) std::swap(b, c);
    wedges_.insert(wedges_.end(), {{a, b, c}, {b, c, a}, {c, a, b}});
  }
  /// From the wedges of a vertex to its ring: an open fan begins with the neighbour that follows none.
  void take_ring(RingedVertex& v) {
    const std::span<const Wedge> wedges = std::ranges::equal_range(wedges_, v.vertex, {}, &Wedge::vertex);
    if (wedges.empty()) throw std::logic_error("the strip at a block's side leaves a vertex without a triangle");
    std::uint32_t first = wedges.front().from;
    for (const Wedge& wedge : wedges) {
      if (std::ranges::find(wedges, wedge.from, &Wedge::to) == wedges.end()) first = wedge.from;
    }
    std::size_t count = 0;
    std::uint32_t at = first;
    for (;;) {
      if (count == kRingWidth) throw std::logic_error("the strip at a block's side has a vertex with more than 14 neighbours");
      v.ring[count++] = at;
      const auto next = std::ranges::find(wedges, at, &Wedge::from);
      if (next == wedges.end() || next->to == first) break;
      at = next->to;
    }
    v.valence = static_cast<std::uint8_t>(count);
    if (count < wedges.size()) throw std::logic_error("the strip at a block's side is no manifold");
  }

  const StripSides& sides_;
  const std::span<const RingedVertex> hem_;
  const std::uint32_t own_;
  const LevelRules rules_;
  const std::int32_t step_;
  Strip strip_;
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_;  ///< of added vertices, by position
  std::vector<Wedge> wedges_;                                 ///< in order once all are there
};

}  // namespace

std::vector<std::uint32_t> held_on_hem(const StripSides& sides, std::span<const RingedVertex> hem, int rim_reach) {
  std::vector<std::uint32_t> held;
  for (const RingedVertex& v : hem) {
    const bool deep = v.depth == 0 || has_deep_valid(v.depth, rim_reach) || has_deep_void(v.depth, rim_reach);
    if (!deep) held.push_back(v.vertex);
  }
  for (int side = 0; side < 4; ++side) {
    if (!sides.shared[static_cast<std::size_t>(side)]) continue;
    const Row row = hem_of(SideFrame(sides, side), hem);
    const std::vector<int>& chain = sides.chain[static_cast<std::size_t>(side)].place;
    std::size_t next = 0;
    int since = 0;
    for (std::size_t k = 0; k + 1 < row.size(); ++k) {
      const std::size_t before = next;
      while (next < chain.size() && chain[next] <= row[k + 1].s) ++next;
      const auto between = static_cast<int>(next - before);
      if (since > 0 && since + between > kChainPerHem) {
        held.push_back(row[k].vertex);
        since = 0;
      }
      since += between;
    }
  }
  return held;
}

Strip make_strip(const StripSides& sides, std::span<const RingedVertex> hem, std::uint32_t own, const LevelRules& rules) {
  return StripMaker(sides, hem, own, rules).make();
}

}  // namespace cordillera::gpu::exact
