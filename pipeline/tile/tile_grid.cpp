#include "pipeline/tile/tile_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "pipeline/tile/sample_at.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

/// A rectangle's side, or a row along it.
struct SideRow {
  std::vector<std::uint32_t> vertex;
  std::vector<std::int32_t> at;  ///< along the side, ascending from its western or southern end
};
/// South, east, north, west, around a rectangle. Corners are of two rows.
using Frame = std::array<SideRow, 4>;
enum FrameSide : std::size_t { kSouth, kEast, kNorth, kWest };

bool runs_east(std::size_t turn) { return turn == kSouth || turn == kNorth; }

class GridMaker {
 public:
  GridMaker(const proto::Lattice& lattice, const BuiltTile& tile, const proto::Samples& samples, std::int64_t step)
      : lattice_(lattice), samples_(samples), from_(tile.mesh), west_(lattice.west(tile.tile)), south_(lattice.south(tile.tile)) {
    const auto [x0, x1] = std::ranges::minmax_element(from_.x);
    const auto [y0, y1] = std::ranges::minmax_element(from_.y);
    low_ = {*x0, *y0}, high_ = {*x1, *y1};
    mesh_.side = from_.side;
    // Of data that is small in its tile, or in few tiles, there are to be enough vertices all the same.
    constexpr std::int32_t kLeastCells = 32;
    const auto narrow = static_cast<std::uint32_t>(std::min(high_[0] - low_[0], high_[1] - low_[1]) / kLeastCells);
    step_ = static_cast<std::int32_t>(
        std::min({step, std::int64_t{std::bit_floor(std::max(narrow, 1U))}, std::int64_t{proto::kTileCells}}));
  }

  TileMesh mesh() {
    Frame frame = sides();
    std::int32_t inset = 0;
    while (inset % step_ > 0 || !is_even(frame)) {
      inset = inset == 0 ? 1 : inset < step_ ? 2 * inset : inset + step_;
      Frame inner = evener(frame, inset);
      for (std::size_t turn = 0; turn < 4; ++turn) fill_strip(frame[turn], inner[turn], turn);
      frame = std::move(inner);
    }
    fill_inside(frame, inset);
    return std::move(mesh_);
  }

 private:
  using Place = std::array<std::int32_t, 2>;

  std::uint32_t add(const Place& p, std::int32_t height, std::uint8_t mark) {
    const bool none = height == proto::kNoHeight;
    mesh_.x.push_back(p[0]);
    mesh_.y.push_back(p[1]);
    mesh_.height.push_back(none ? 0 : height);
    mesh_.mark.push_back(static_cast<std::uint8_t>(mark | (none ? proto::kVoid : 0)));
    return static_cast<std::uint32_t>(mesh_.vertices() - 1);
  }
  std::uint32_t add_sample(const Place& p) { return add(p, sample_at(samples_, lattice_, west_ + p[0], south_ + p[1]), 0); }
  /// Of a row so far inside a side.
  Place place(std::size_t turn, std::int32_t inset, std::int32_t at) const {
    switch (turn) {
      case kSouth: return {at, low_[1] + inset};
      case kEast: return {high_[0] - inset, at};
      case kNorth: return {at, high_[1] - inset};
      default: return {low_[0] + inset, at};
    }
  }
  std::int32_t low(std::size_t turn) const { return low_[runs_east(turn) ? 0 : 1]; }
  std::int32_t high(std::size_t turn) const { return high_[runs_east(turn) ? 0 : 1]; }

  /// The tile's own.
  Frame sides() {
    std::vector<std::uint32_t> number(from_.vertices(), 0);
    for (std::uint32_t v = 0; v < number.size(); ++v) {
      if (from_.x[v] != low_[0] && from_.x[v] != high_[0] && from_.y[v] != low_[1] && from_.y[v] != high_[1]) continue;
      number[v] = add({from_.x[v], from_.y[v]}, is_void(from_, v) ? proto::kNoHeight : from_.height[v], proto::kKeep);
    }
    Frame square;
    for (std::size_t turn = 0; turn < 4; ++turn) {
      const auto& along = runs_east(turn) ? from_.x : from_.y;
      const auto& across = runs_east(turn) ? from_.y : from_.x;
      const std::int32_t line = runs_east(turn) ? place(turn, 0, 0)[1] : place(turn, 0, 0)[0];
      std::vector<std::pair<std::int32_t, std::uint32_t>> those;
      for (std::uint32_t v = 0; v < number.size(); ++v)
        if (across[v] == line) those.emplace_back(along[v], number[v]);
      std::sort(those.begin(), those.end());
      for (const auto& [at, v] : those) square[turn].at.push_back(at), square[turn].vertex.push_back(v);
    }
    return square;
  }

  /// Of the next row inwards, so far inside: every cell's end where the outer row is nearly as even. Else edges of two cells and
  /// more are halved, and where two in turn are shorter together than rows are apart they become one.
  std::vector<std::int32_t> next_row(const std::vector<std::int32_t>& outer, std::size_t turn, std::int32_t inset) const {
    const std::int32_t first = low(turn) + inset, last = high(turn) - inset, apart = std::min(inset, step_);
    std::vector<std::int32_t> row{first};
    if (inset % step_ == 0 && is_nearly_even(outer)) {
      for (std::int32_t p = first + step_; p <= last; p += step_) row.push_back(p);
      return row;
    }
    const auto more = [&](std::int32_t p) {
      if (p > row.back() && p < last) row.push_back(p);
    };
    bool passed = false;
    for (std::size_t k = 0; k + 1 < outer.size(); ++k) {
      const std::int32_t a = outer[k], b = outer[k + 1];
      passed = !passed && b - row.back() <= apart;
      if (k > 0 && !passed) more(a);
      if (b - a >= 2 * step_) more(a + (b - a) / 2);
    }
    row.push_back(last);
    return row;
  }
  Frame evener(const Frame& outer, std::int32_t inset) {
    Frame frame;
    for (std::size_t turn = 0; turn < 4; ++turn) {
      const std::vector<std::int32_t>& row = outer[turn].at;
      const bool is_bare_side = inset == 1 && row.size() == 2;  // its corners have no room
      frame[turn].at = is_bare_side ? std::vector{low(turn) + inset, high(turn) - inset} : next_row(row, turn, inset);
    }
    // Corners are of two rows.
    for (const std::size_t turn : {kSouth, kNorth}) {
      for (const std::int32_t p : frame[turn].at) frame[turn].vertex.push_back(add_sample(place(turn, inset, p)));
    }
    for (const std::size_t turn : {kEast, kWest}) {
      const auto corner = [&](const SideRow& row) { return turn == kWest ? row.vertex.front() : row.vertex.back(); };
      SideRow& row = frame[turn];
      row.vertex.push_back(corner(frame[kSouth]));
      for (std::size_t k = 1; k + 1 < row.at.size(); ++k) row.vertex.push_back(add_sample(place(turn, inset, row.at[k])));
      row.vertex.push_back(corner(frame[kNorth]));
    }
    return frame;
  }

  bool is_nearly_even(const std::vector<std::int32_t>& row) const {
    constexpr std::size_t kMostInACell = 3;
    for (std::size_t k = 0; k + 1 < row.size(); ++k) {
      if (row[k + 1] - row[k] > 2 * step_) return false;
      if (k + kMostInACell < row.size() && row[k + kMostInACell] - row[k] < step_) return false;
    }
    return true;
  }
  bool is_even(const Frame& frame) const {
    return std::ranges::all_of(frame, [&](const SideRow& row) {
      for (std::size_t k = 0; k + 1 < row.at.size(); ++k)
        if (row.at[k + 1] - row.at[k] != step_) return false;
      return true;
    });
  }

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::size_t turn) {
    if (turn == kSouth || turn == kEast)
      mesh_.triangles.push_back({a, b, c});
    else
      mesh_.triangles.push_back({a, c, b});
  }
  /// Which of two rows the next triangle has an edge of, after so many edges of the outer and of the inner one.
  static bool goes_along_outer(const SideRow& outer, const SideRow& inner, std::array<std::size_t, 2> after, std::size_t turn) {
    const auto [o, i] = after;
    if (i + 1 == inner.at.size()) return true;
    if (o + 1 == outer.at.size()) return false;
    const bool is_first = o == 0, is_last = o + 2 == outer.at.size();
    if (is_first && is_last) return turn == kSouth || turn == kEast;  // so each corner gets one of four such sides
    if (is_first || is_last) return is_first;
    return std::abs(outer.at[o + 1] - inner.at[i]) <= std::abs(inner.at[i + 1] - outer.at[o]);
  }
  /// Between two parallel rows: any order of triangles along them has positive area. The shorter diagonal is taken, but no corner
  /// of the outer row gets more than one.
  void fill_strip(const SideRow& outer, const SideRow& inner, std::size_t turn) {
    std::size_t o = 0, i = 0;
    while (o + 1 < outer.at.size() || i + 1 < inner.at.size()) {
      if (goes_along_outer(outer, inner, {o, i}, turn)) {
        add_triangle(outer.vertex[o], outer.vertex[o + 1], inner.vertex[i], turn);
        ++o;
      } else {
        add_triangle(outer.vertex[o], inner.vertex[i + 1], inner.vertex[i], turn);
        ++i;
      }
    }
  }

  /// All that is within a frame of even rows.
  void fill_inside(const Frame& frame, std::int32_t inset) {
    const std::size_t columns = frame[kSouth].at.size(), rows = frame[kWest].at.size();
    std::vector<std::uint32_t> number(columns * rows, UINT32_MAX);
    const auto at = [&](std::size_t c, std::size_t r) -> std::uint32_t& { return number[r * columns + c]; };
    for (std::size_t c = 0; c < columns; ++c) at(c, 0) = frame[kSouth].vertex[c], at(c, rows - 1) = frame[kNorth].vertex[c];
    for (std::size_t r = 0; r < rows; ++r) at(0, r) = frame[kWest].vertex[r], at(columns - 1, r) = frame[kEast].vertex[r];
    for (std::size_t r = 1; r + 1 < rows; ++r) {
      for (std::size_t c = 1; c + 1 < columns; ++c)
        at(c, r) = add_sample(
            {low_[0] + inset + static_cast<std::int32_t>(c) * step_, low_[1] + inset + static_cast<std::int32_t>(r) * step_});
    }
    for (std::size_t r = 0; r + 1 < rows; ++r) {
      for (std::size_t c = 0; c + 1 < columns; ++c) {
        mesh_.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
        mesh_.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
      }
    }
  }

  const proto::Lattice& lattice_;
  const proto::Samples& samples_;
  const TileMesh& from_;
  const std::int64_t west_, south_;
  Place low_{}, high_{};
  std::int32_t step_ = 1;  ///< between vertices, units
  TileMesh mesh_;
};

}  // namespace

TileMesh tile_grid(const proto::Lattice& lattice, const BuiltTile& tile, const proto::Samples& samples, std::int64_t step) {
  return GridMaker(lattice, tile, samples, step).mesh();
}

std::vector<float> elevations(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& mesh) {
  const double radians = lattice.cell_deg() * std::numbers::pi / 180;
  const double middle = mesh.side / 2.0;
  const proto::RowFrame row = proto::row_frame(lattice, lattice.south(tile) + mesh.side / 2);
  const double along_column = proto::kSemiMajor_m * radians * radians / 2;
  const double along_row = along_column * row.cos_lat * row.cos_lat;
  std::vector<float> elevation(mesh.vertices());
  for (std::size_t v = 0; v < elevation.size(); ++v) {
    const double dx = mesh.x[v] - middle, dy = mesh.y[v] - middle;
    elevation[v] = static_cast<float>(mesh.height[v] * proto::kHeightStep_m - along_row * dx * dx - along_column * dy * dy);
  }
  return elevation;
}

}  // namespace cordillera::pipeline
