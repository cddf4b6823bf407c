#include "pipeline/tile/chain.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

using proto::kNoHeight;
using proto::Vec3;

// A valid sample in space.
struct Placed {
  std::int32_t position = 0;
  bool candidate = false;
  Vec3 at, up;
};

// A stretch of candidates of one label. first and last (indices of candidates) carry the run's label; what lies between may have
// the other label when a short run was dropped.
struct Run {
  std::size_t first = 0, last = 0;
  bool valid = false;
};

// heights are those at positions first, first + 1, ...
std::vector<Placed> place_all(const Edge& edge, std::span<const std::int32_t> heights, std::int64_t first = 0) {
  const std::size_t count = heights.size();
  const bool east = edge.along == Along::east;
  const auto rows = proto::row_frames(*edge.lattice, edge.row + (east ? 0 : first), east ? 1 : count);
  const auto columns = proto::column_frames(*edge.lattice, edge.column + (east ? first : 0), east ? count : 1);
  std::vector<Placed> placed;
  placed.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    if (heights[k] == kNoHeight) continue;
    const auto& row = rows[east ? 0 : k];
    const auto& column = columns[east ? k : 0];
    placed.push_back({static_cast<std::int32_t>(first + static_cast<std::int64_t>(k)), false,
                      proto::ecef(row, column, heights[k] * proto::kHeightStep_m), proto::normal(row, column)});
  }
  return placed;
}

// Far above the blocks an edge has up to 2^30 units: only its vertices are placed.
std::vector<Placed> place_vertices(const Edge& edge, const Chain& chain) {
  std::vector<Placed> placed;
  for (std::size_t k = 0; k < chain.position.size(); ++k) {
    if (chain.height[k] == kNoHeight) continue;
    Edge here = edge;
    (edge.along == Along::east ? here.column : here.row) += chain.position[k];
    Placed p = place_all(here, {&chain.height[k], 1}).front();
    p.position = chain.position[k];
    placed.push_back(p);
  }
  return placed;
}

void mark_candidates(std::vector<Placed>& placed, const Chain& candidates) {
  std::size_t k = 0;
  for (std::size_t c = 0; c < candidates.position.size(); ++c) {
    if (candidates.height[c] == kNoHeight) continue;
    while (k < placed.size() && placed[k].position < candidates.position[c]) ++k;
    if (k < placed.size() && placed[k].position == candidates.position[c]) placed[k].candidate = true;
  }
}

// How far the chord a-b is from s, along the normal at s: |t| at the points of the lines s + t up and a + r (b - a) that are
// closest.
double distance_to_chord_m(const Placed& a, const Vec3& chord, const Placed& s) {
  const Vec3 w = a.at - s.at;
  const double along = dot(s.up, chord), height = dot(s.up, w);
  const double denominator = dot(chord, chord) - along * along;
  // On a pole row the chord has no length: its end is what there is.
  const double r = denominator > 1e-6 ? (along * height - dot(chord, w)) / denominator : 0.0;
  const double t = height + r * along;
  return t < 0 ? -t : t;
}

// A line of samples beside the edge, indexed by position - first; `valid` where there is data.
struct Witness {
  std::vector<Placed> at;
  std::vector<char> valid;
};

std::vector<Witness> witnesses(const Edge& edge, const EdgeHeights& heights) {
  std::vector<Witness> lines;
  for (const EdgeHeights::Line& line : heights.beside) {
    Edge beside = edge;
    (edge.along == Along::east ? beside.row : beside.column) += line.offset;
    Witness witness{std::vector<Placed>(line.heights.size()), std::vector<char>(line.heights.size(), 0)};
    for (const Placed& placed : place_all(beside, line.heights, heights.first)) {
      const auto at = static_cast<std::size_t>(placed.position - heights.first);
      witness.at[at] = placed;
      witness.valid[at] = 1;
    }
    lines.push_back(std::move(witness));
  }
  return lines;
}

// Indices into the placed samples; first and last stay.
struct Piece {
  std::size_t first = 0, last = 0;
};

// Everything that significance is measured against.
struct Terrain {
  std::vector<Placed> line;
  std::vector<Witness> beside;
  std::int64_t first = 0;  // position of the witnesses' first sample

  // How far the sample is from the piece's chord, on the edge or on a line beside it, whichever is farther.
  double deviation_m(const Piece& piece, const Vec3& chord, std::size_t k) const {
    const Placed &a = line[piece.first], &b = line[piece.last];
    double most = distance_to_chord_m(a, chord, line[k]);
    for (const Witness& witness : beside) {
      const auto from = static_cast<std::size_t>(a.position - first), to = static_cast<std::size_t>(b.position - first);
      const auto here = static_cast<std::size_t>(line[k].position - first);
      if (!witness.valid[from] || !witness.valid[to] || !witness.valid[here]) continue;
      const Vec3 beside_chord = witness.at[to].at - witness.at[from].at;
      most = std::max(most, distance_to_chord_m(witness.at[from], beside_chord, witness.at[here]));
    }
    return most;
  }
};

// Where to break the piece; first when it may stay whole.
std::size_t split_of(const Terrain& terrain, const Piece& piece, const ChainRule& rule) {
  const std::vector<Placed>& s = terrain.line;
  const Placed &a = s[piece.first], &b = s[piece.last];
  const Vec3 chord = b.at - a.at;
  const std::int64_t middle2 = std::int64_t{a.position} + b.position;
  double worst = 0, most = -1;
  std::size_t significant = piece.first, middle = piece.first;
  std::int64_t off_middle2 = INT64_MAX;
  for (std::size_t k = piece.first + 1; k < piece.last; ++k) {
    const double d = terrain.deviation_m(piece, chord, k);
    if (d > worst) worst = d;
    if (!s[k].candidate) continue;
    if (d > most) {
      most = d;
      significant = k;
    }
    const std::int64_t off2 = std::abs(2 * std::int64_t{s[k].position} - middle2);
    if (off2 < off_middle2) {
      off_middle2 = off2;
      middle = k;
    }
  }
  if (worst > rule.tolerance_m) return significant;
  return rule.max_gap_units > 0 && b.position - a.position > rule.max_gap_units ? middle : piece.first;
}

// Douglas-Peucker from the top, along one run of data; sets kept for positions.
void keep_significant(const Terrain& terrain, Piece run, const ChainRule& rule, std::vector<std::int32_t>& kept) {
  std::vector<Piece> open{run};
  while (!open.empty()) {
    const Piece piece = open.back();
    open.pop_back();
    if (piece.last <= piece.first + 1) continue;
    const std::size_t split = split_of(terrain, piece, rule);
    if (split == piece.first) continue;
    kept.push_back(terrain.line[split].position);
    open.push_back({piece.first, split});
    open.push_back({split, piece.last});
  }
}

std::vector<Run> runs_of(const Chain& chain) {
  std::vector<Run> runs;
  for (std::size_t k = 0; k < chain.height.size(); ++k) {
    const bool valid = chain.height[k] != kNoHeight;
    if (runs.empty() || runs.back().valid != valid) runs.push_back({k, k, valid});
    runs.back().last = k;
  }
  return runs;
}

// Drops the inner runs of one label that are too short, left to right; their neighbours become one run. Only valid vertices are
// measured, because the ends of data survive every level and a void representative does not show where the void ends.
std::vector<Run> without_short_runs(const std::vector<Run>& runs, bool valid, const ChainRule& rule, Chain& chain) {
  std::vector<Run> rest;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (!rest.empty() && rest.back().valid == runs[k].valid) {
      rest.back().last = runs[k].last;
      continue;
    }
    const bool inner = k > 0 && k + 1 < runs.size();
    if (inner && runs[k].valid == valid) {
      const std::size_t from = valid ? runs[k].first : rest.back().last;
      const std::size_t to = valid ? runs[k].last : runs[k + 1].first;
      if (chain.position[to] - chain.position[from] < rule.rim_units) {
        ++chain.dropped_runs;
        continue;
      }
    }
    rest.push_back(runs[k]);
  }
  return rest;
}

// The void vertex that is likeliest to survive on coarser levels as well.
std::int32_t void_representative(const Chain& chain, const Run& run) {
  std::int32_t best = -1;
  int most_zeros = -1;
  for (std::size_t k = run.first; k <= run.last; ++k) {
    if (chain.height[k] != kNoHeight) continue;
    const int zeros = std::countr_zero(static_cast<std::uint32_t>(chain.position[k]));
    if (zeros > most_zeros) {
      most_zeros = zeros;
      best = chain.position[k];
    }
  }
  return best;
}

// Vertices that nobody sees, or sees as one point, but that triangles of the tile's inside can end at.
bool supports(const Edge& edge, const ChainRule& rule, std::int32_t position, bool is_void) {
  const std::int64_t rows = edge.lattice->rows();
  if (edge.along == Along::east && (edge.row == 0 || edge.row == rows)) return position % rule.pole_gap_units == 0;
  if (is_void) return position % rule.void_gap_units == 0;
  // A meridian that ends at a pole: the long thin triangles there need something to end at, the closer to the pole the more.
  if (edge.along == Along::east) return false;
  const bool from_pole = edge.row == 0, to_pole = edge.row + edge.units == rows;
  return (from_pole && std::has_single_bit(static_cast<std::uint64_t>(position))) ||
         (to_pole && std::has_single_bit(static_cast<std::uint64_t>(edge.units - position)));
}

void keep_support(const Edge& edge, const Chain& chain, const ChainRule& rule, std::vector<std::int32_t>& kept) {
  for (std::size_t k = 0; k < chain.position.size(); ++k) {
    if (supports(edge, rule, chain.position[k], chain.height[k] == kNoHeight)) kept.push_back(chain.position[k]);
  }
}

// Next to where a rim comes as near the edge as a level or a coarser one of the block cares for, and where it leaves it: the
// nearest candidate on either hand.
void keep_near_rims(const Chain& chain, const EdgeHeights& heights, std::int64_t reach, std::vector<std::int32_t>& kept) {
  std::size_t next = 0;
  for (std::size_t k = 1; k < heights.to_void.size(); ++k) {
    if ((heights.to_void[k] <= reach) == (heights.to_void[k - 1] <= reach)) continue;
    const std::int64_t from = heights.first + static_cast<std::int64_t>(k);
    while (next < chain.position.size() && chain.position[next] < from) ++next;
    if (next > 0) kept.push_back(chain.position[next - 1]);
    if (next < chain.position.size()) kept.push_back(chain.position[next]);
  }
}

Piece piece_of(const std::vector<Placed>& placed, std::int32_t from, std::int32_t to) {
  const auto index = [&](std::int32_t position) {
    std::size_t low = 0, high = placed.size();
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (placed[middle].position <= position ? low : high) = middle;
    }
    return low;
  };
  return {index(from), index(to)};
}

// A run's pieces between vertices that stay anyway: a chord ends at each of them, and another one than was measured might leave a
// sample too far.
std::vector<Piece> between(const std::vector<Placed>& placed, const std::vector<std::int32_t>& stay, std::int32_t from,
                           std::int32_t to) {
  std::vector<Piece> pieces;
  std::int32_t last = from;
  for (const std::int32_t at : stay) {
    if (at <= last || at >= to || placed[piece_of(placed, at, to).first].position != at) continue;
    pieces.push_back(piece_of(placed, last, at));
    last = at;
  }
  pieces.push_back(piece_of(placed, last, to));
  return pieces;
}

Chain only(const Chain& chain, std::vector<std::int32_t>& kept) {
  std::sort(kept.begin(), kept.end());
  Chain result;
  result.dropped_runs = chain.dropped_runs;
  std::size_t next = 0;
  for (std::size_t k = 0; k < chain.position.size(); ++k) {
    while (next < kept.size() && kept[next] < chain.position[k]) ++next;
    if (next == kept.size() || kept[next] != chain.position[k]) continue;
    result.position.push_back(chain.position[k]);
    result.height.push_back(chain.height[k]);
  }
  return result;
}

Chain reduce(const Edge& edge, Chain candidates, const EdgeHeights& heights, Terrain terrain, const ChainRule& rule) {
  candidates.dropped_runs = 0;
  mark_candidates(terrain.line, candidates);
  // Voids first: two stretches of data that a small hole parts are one stretch, and not each too short.
  std::vector<Run> runs = without_short_runs(runs_of(candidates), false, rule, candidates);
  runs = without_short_runs(runs, true, rule, candidates);
  std::vector<std::int32_t> anyway;
  if (rule.void_gap_units > 0) keep_support(edge, candidates, rule, anyway);
  for (std::int64_t reach = heights.cell; reach <= heights.reach; reach *= 2) keep_near_rims(candidates, heights, reach, anyway);
  std::sort(anyway.begin(), anyway.end());
  std::vector<std::int32_t> kept = anyway;
  kept.push_back(candidates.position.front());
  kept.push_back(candidates.position.back());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const std::int32_t from = candidates.position[runs[k].first], to = candidates.position[runs[k].last];
    if (runs[k].valid) {
      kept.push_back(from);
      kept.push_back(to);
      for (const Piece& piece : between(terrain.line, anyway, from, to)) keep_significant(terrain, piece, rule, kept);
    } else if (k > 0 && k + 1 < runs.size()) {
      kept.push_back(void_representative(candidates, runs[k]));
    }
  }
  return only(candidates, kept);
}

}  // namespace

Edge edge_of(const proto::Lattice& lattice, const proto::TileAddress& tile, Side side) {
  const std::int64_t units = lattice.tile_units(tile.z);
  Edge edge{&lattice, lattice.west(tile), lattice.south(tile), Along::east, units};
  if (side == Side::east) edge.column += units;
  if (side == Side::north) edge.row += units;
  if (side == Side::west || side == Side::east) edge.along = Along::north;
  return edge;
}

Chain chain_finest(const Edge& edge, const EdgeHeights& heights, const ChainRule& rule) {
  Chain all;
  all.height.assign(heights.edge.begin(), heights.edge.end());
  all.position.resize(heights.edge.size());
  for (std::size_t k = 0; k < heights.edge.size(); ++k) all.position[k] = static_cast<std::int32_t>(k);
  return reduce(edge, std::move(all), heights, {place_all(edge, heights.edge), witnesses(edge, heights), 0}, rule);
}

Chain simplify_chain(const Edge& edge, const Chain& candidates, const EdgeHeights& heights, const ChainRule& rule) {
  if (heights.edge.empty()) return reduce(edge, candidates, heights, {place_vertices(edge, candidates), {}, 0}, rule);
  return reduce(edge, candidates, heights,
                {place_all(edge, heights.edge, heights.first), witnesses(edge, heights), heights.first}, rule);
}

Chain void_chain(std::int32_t units, std::int32_t void_gap_units) {
  Chain chain;
  for (std::int64_t k = 0; k<units; k += void_gap_units> 0 ? void_gap_units : units)
    chain.position.push_back(static_cast<std::int32_t>(k));
  chain.position.push_back(units);
  chain.height.assign(chain.position.size(), kNoHeight);
  return chain;
}

}  // namespace cordillera::pipeline
