#include "raster/voids/void_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/integers.h"
#include "proto/mesh.h"
#include "raster/voids/void_spline.h"

namespace cordillera::raster {
namespace {

constexpr std::int64_t kChunk = 128;      // vertices a side; circles of columns are multiples of it
constexpr std::size_t kMostChunks = 112;  // kept between searches
constexpr std::int64_t kRim = 2;          // vertices around a void that its fill looks at
constexpr double kMostStretch = 16;       // of a cell: beyond 86 degrees

using proto::modulo;

/// Height of a cell over its width, in steps that no library's last bit can turn.
double stretch_at(double latitude_deg) {
  const double stretch = 1 / std::max(std::cos(latitude_deg * std::numbers::pi / 180), 1 / kMostStretch);
  return std::nearbyint(stretch * 64) / 64;
}

std::int32_t in_steps(double height_m) {
  const double held_m = std::clamp(height_m, -proto::kMaxHeight_m, proto::kMaxHeight_m);
  return static_cast<std::int32_t>(std::nearbyint(held_m / proto::kHeightStep_m));
}

}  // namespace

void VoidMap::Void::add(const Vertex& vertex) {
  if (vertices.empty()) {
    west = east = vertex.column;
    south = north = vertex.row;
  }
  west = std::min(west, vertex.column), east = std::max(east, vertex.column);
  south = std::min(south, vertex.row), north = std::max(north, vertex.row);
  vertices.push_back(vertex);
}

VoidMap::VoidMap(Source& source, const proto::Lattice& lattice, std::uint32_t limit_cells)
    : source_(source),
      lattice_(lattice),
      limit_(std::min<std::int64_t>(limit_cells, lattice.columns() / 4)),
      window_(source.window(lattice)) {}

bool VoidMap::inside(const Vertex& vertex) const {
  // A pole's row is one point, whatever its columns.
  if (vertex.row <= 0 || vertex.row >= lattice_.rows() || vertex.row < window_.south || vertex.row > window_.north) return false;
  return in_turn(vertex.column - window_.west) <= window_.east - window_.west;
}

std::size_t VoidMap::index_in_chunk(const Vertex& vertex) {
  return static_cast<std::size_t>(modulo(vertex.row, kChunk) * kChunk + modulo(vertex.column, kChunk));
}

/// Rows are those of the lattice. The pointer is good until forget_oldest().
proto::Result<VoidMap::Chunk*> VoidMap::chunk_of(const Vertex& vertex) {
  const std::int64_t column = in_turn(vertex.column) / kChunk, row = vertex.row / kChunk;
  if (last_ != nullptr && last_place_ == Place(row, column)) return last_;
  Chunk& chunk = chunks_[{row, column}];
  chunk.used = ++clock_;
  last_place_ = {row, column};
  last_ = &chunk;
  if (!chunk.height.empty()) return &chunk;
  const std::int64_t rows = std::min(kChunk, lattice_.rows() + 1 - row * kChunk);
  auto samples = source_.sample(lattice_, column * kChunk, row * kChunk, kChunk, static_cast<std::int32_t>(rows));
  if (!samples.ok()) {
    chunks_.erase({row, column});
    last_ = nullptr;
    return samples.problem();
  }
  chunk.height = std::move(samples->height);
  chunk.state.reserve(chunk.height.size());
  for (const std::int32_t height : chunk.height) chunk.state.push_back(height == proto::kNoHeight ? unknown : data);
  return &chunk;
}

void VoidMap::forget_oldest() {
  if (chunks_.size() > kMostChunks) last_ = nullptr;
  while (chunks_.size() > kMostChunks) {
    chunks_.erase(std::min_element(chunks_.begin(), chunks_.end(),
                                   [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
  }
}

/// A vertex beside one of the void: part of it, its end, or what shows that it stays.
proto::Result<void> VoidMap::see(const Vertex& vertex, Void& found, std::vector<Vertex>& ahead) {
  if (!inside(vertex)) {
    found.stays = true;
    return {};
  }
  const auto chunk = chunk_of(vertex);
  if (!chunk.ok()) return chunk.problem();
  State& state = (*chunk)->state[index_in_chunk(vertex)];
  if (state == open) found.stays = true;
  if (state != unknown && state != filled) return {};  // filled: in another piece that was read long ago
  state = seen;
  found.add(vertex);
  ahead.push_back(vertex);
  if (found.east - found.west >= limit_ || found.north - found.south >= limit_) found.stays = true;
  return {};
}

/// Straight on as far as it goes: what is too large, or reaches the rim, is soon known to be.
proto::Result<VoidMap::Void> VoidMap::search(const Vertex& from) {
  Void found;
  std::vector<Vertex> ahead;
  if (auto seen_it = see(from, found, ahead); !seen_it.ok()) return seen_it.problem();
  while (!ahead.empty() && !found.stays) {
    const Vertex v = ahead.back();
    ahead.pop_back();
    for (const Vertex& beside :
         {Vertex{v.column - 1, v.row}, Vertex{v.column + 1, v.row}, Vertex{v.column, v.row - 1}, Vertex{v.column, v.row + 1}}) {
      if (auto seen_it = see(beside, found, ahead); !seen_it.ok()) return seen_it.problem();
    }
  }
  return found;
}

void VoidMap::mark(const Void& found, State state) {
  for (const Vertex& vertex : found.vertices) (*chunk_of(vertex))->state[index_in_chunk(vertex)] = state;  // they have been read
}

proto::Result<void> VoidMap::fill(const Void& found) {
  VoidGrid grid(static_cast<int>(found.east - found.west + 1 + 2 * kRim),
                static_cast<int>(found.north - found.south + 1 + 2 * kRim));
  grid.stretch = stretch_at(lattice_.latitude_deg((found.south + found.north) / 2));
  const std::int64_t west = found.west - kRim, south = found.south - kRim;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.columns; ++x) {
      const Vertex vertex{west + x, south + y};
      if (!inside(vertex)) continue;
      const auto chunk = chunk_of(vertex);
      if (!chunk.ok()) return chunk.problem();
      const std::size_t at = index_in_chunk(vertex);
      if ((*chunk)->state[at] != data) continue;
      grid.cell[grid.at(x, y)] = VoidGrid::known;
      grid.height_m[grid.at(x, y)] = (*chunk)->height[at] * proto::kHeightStep_m;
    }
  }
  const auto place = [&](const Vertex& vertex) {
    return grid.at(static_cast<int>(vertex.column - west), static_cast<int>(vertex.row - south));
  };
  for (const Vertex& vertex : found.vertices) grid.cell[place(vertex)] = VoidGrid::wanted;
  fill_spline(grid);
  for (const Vertex& vertex : found.vertices)
    (*chunk_of(vertex))->height[index_in_chunk(vertex)] = in_steps(grid.height_m[place(vertex)]);
  return {};
}

/// Whether a void vertex stays void. A neighbour of what stays does, and so need not be searched from.
proto::Result<void> VoidMap::decide(const Vertex& vertex, Chunk& chunk) {
  const std::size_t at = index_in_chunk(vertex);
  const bool open_beside = (modulo(vertex.column, kChunk) > 0 && chunk.state[at - 1] == open) ||
                           (vertex.row % kChunk > 0 && chunk.state[at - kChunk] == open);
  if (open_beside || !inside(vertex)) {
    chunk.state[at] = open;
    return {};
  }
  const auto found = search(vertex);
  if (!found.ok()) return found.problem();
  if (!found->stays) {
    if (auto done = fill(*found); !done.ok()) return done.problem();
  }
  mark(*found, found->stays ? open : filled);
  return {};
}

/// Vertices of one row and one chunk.
proto::Result<void> VoidMap::fill_in(const Vertex& first, std::int32_t count, std::int32_t* height, std::uint8_t* mark) {
  Chunk* chunk = nullptr;
  for (std::int32_t k = 0; k < count; ++k) {
    if (height[k] != proto::kNoHeight) continue;
    const Vertex vertex{first.column + k, first.row};
    if (chunk == nullptr) {
      if (!inside(vertex)) continue;
      const auto found = chunk_of(vertex);
      if (!found.ok()) return found.problem();
      chunk = *found;
    }
    const std::size_t at = index_in_chunk(vertex);
    if (chunk->state[at] == unknown) {
      if (auto done = decide(vertex, *chunk); !done.ok()) return done;
    }
    if (chunk->state[at] == open) continue;
    height[k] = chunk->height[at];
    mark[k] = proto::kFilledVoid;
  }
  forget_oldest();
  return {};
}

proto::Result<void> VoidMap::fill_in(proto::Samples& samples) {
  for (std::int32_t r = 0; r < samples.rows; ++r) {
    for (std::int32_t c = 0; c < samples.columns;) {
      const Vertex first{samples.west + c, samples.south + r};
      const auto count =
          static_cast<std::int32_t>(std::min(kChunk - modulo(first.column, kChunk), std::int64_t{samples.columns - c}));
      const std::size_t at =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(samples.columns) + static_cast<std::size_t>(c);
      if (auto done = fill_in(first, count, samples.height.data() + at, samples.flat_water.data() + at); !done.ok()) return done;
      c += count;
    }
  }
  return {};
}

}  // namespace cordillera::raster
