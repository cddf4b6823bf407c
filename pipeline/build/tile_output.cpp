#include "pipeline/build/tile_output.h"

#include <algorithm>
#include <utility>

#include "gpu/measure/surface_error_row.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/mesh/mesh_point.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"
#include "pipeline/encode/rim_slivers.h"
#include "pipeline/encode/tile_glb.h"
#include "pipeline/finest/pixel_error.h"
#include "pipeline/plan/plan.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

/// Of the level's target: by so much more a triangle between two rows of samples on a rim may be off.
constexpr double kMostLean = 0.25;

/// Of a square of so many cells; south_west: on the samples' turn.
SampleCount count_square(const proto::Lattice& lattice, const proto::Samples& samples, std::int64_t west, std::int64_t south,
                         std::int64_t units) {
  // The last row and column of the lattice's rectangle belong to the tile that ends there.
  const std::int64_t north = south + units + (south + units == lattice.rows() ? 1 : 0);
  const std::int64_t first = std::max(west, samples.west), last = std::min(west + units + 1, samples.west + samples.columns);
  const auto own = static_cast<std::size_t>(std::max<std::int64_t>(std::min(last, west + units) - first, 0));
  const auto all = static_cast<std::size_t>(std::max<std::int64_t>(last - first, 0));
  gpu::RowHeights counted, beside;
  SampleCount count;
  for (std::int64_t j = std::max(south, samples.south); all > 0 && j < std::min(south + units + 1, samples.south + samples.rows);
       ++j) {
    const auto at = static_cast<std::size_t>((j - samples.south) * samples.columns + (first - samples.west));
    const std::int32_t* const height = samples.height.data() + at;
    const std::size_t mine = j < north ? own : 0;
    gpu::see_heights(height, mine, counted);
    gpu::see_heights(height + mine, all - mine, beside);
    for (std::size_t k = 0; k < mine && !samples.flat_water.empty(); ++k) {
      const unsigned mark = height[k] == proto::kNoHeight ? 0 : samples.flat_water[at + k];
      count.flat += mark & proto::kFlatWater ? 1 : 0;
      count.filled += mark & proto::kFilledVoid ? 1 : 0;
    }
  }
  count.valid = static_cast<std::uint32_t>(counted.valid);
  count.lowest = std::min(counted.lowest, beside.lowest), count.highest = std::max(counted.highest, beside.highest);
  return count;
}

void set_counts(const SampleCount& count, proto::TileRecord& record) {
  record.set_valid_samples(count.valid);
  record.set_flat_samples(count.flat);
  record.set_filled_samples(count.filled);
  record.set_flat_water(count.valid > 0 && count.flat == count.valid);
  if (count.lowest > count.highest) return;
  record.set_lowest_sample(count.lowest * proto::kHeightStep_m);
  record.set_highest_sample(count.highest * proto::kHeightStep_m);
}

/// In cells of the finest lattice.
double shown_area(const proto::TileMesh& mesh, const PublishedMesh& published) {
  const auto point = [&](std::uint32_t v) { return gpu::MeshPoint{mesh.x[published.source[v]], mesh.y[published.source[v]]}; };
  std::int64_t doubled = 0;
  for (const auto& [a, b, c] : published.triangles) doubled += gpu::twice_area(point(a), point(b), point(c));
  return static_cast<double>(doubled) / 2;
}

void count_mesh(const BuiltTile& built, const PublishedMesh& published, proto::TileRecord& record) {
  const proto::TileMesh& mesh = built.mesh;
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
  std::uint32_t on_border = 0;
  for (const std::uint32_t v : published.source) {
    lowest = std::min(lowest, mesh.height[v]);
    highest = std::max(highest, mesh.height[v]);
    on_border += mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == mesh.side || mesh.y[v] == mesh.side ? 1 : 0;
  }
  record.set_vertices(static_cast<std::uint32_t>(published.source.size()));
  record.set_triangles(static_cast<std::uint32_t>(published.triangles.size()));
  record.set_min_height(lowest * proto::kHeightStep_m);
  record.set_max_height(highest * proto::kHeightStep_m);
  record.set_border_vertices(on_border);
  record.set_shown(shown_area(mesh, published));
}

proto::TileRecord record_at(const proto::TileAddress& tile) {
  proto::TileRecord record;
  record.set_level(static_cast<std::uint32_t>(tile.z));
  record.set_x(static_cast<std::uint32_t>(tile.x));
  record.set_y(static_cast<std::uint32_t>(tile.y));
  return record;
}

proto::TileRecord record_of(const BuiltTile& built) {
  proto::TileRecord record = record_at(built.tile);
  record.set_max_error(built.max_error_m);
  record.set_sum_squared_error(built.measured.sum_squared_m2);
  record.set_samples(built.measured.samples);
  record.set_composed(built.composed);
  record.set_uncovered(built.measured.uncovered);
  record.set_overcovered(built.measured.overcovered);
  record.set_put_back(built.put_back);
  return record;
}

}  // namespace

SampleCounts::SampleCounts(const proto::Lattice& lattice, const proto::Samples& samples, Workers& workers, Workers::Haste haste)
    : lattice_(lattice),
      samples_west_(samples.west),
      samples_east_(samples.west + samples.columns),
      west_(proto::floor_divide(samples.west - 1, proto::kTileCells)),
      south_(proto::floor_divide(samples.south - 1, proto::kTileCells)),
      across_(proto::floor_divide(samples_east_ - 1, proto::kTileCells) - west_ + 1) {
  const std::int64_t rows = proto::floor_divide(samples.south + samples.rows - 1, proto::kTileCells) - south_ + 1;
  squares_.resize(static_cast<std::size_t>(across_ * rows));
  const auto count = [&](std::size_t k, unsigned) {
    const std::int64_t row = south_ + static_cast<std::int64_t>(k) / across_,
                       column = west_ + static_cast<std::int64_t>(k) % across_;
    squares_[k] = count_square(lattice, samples, column * proto::kTileCells, row * proto::kTileCells, proto::kTileCells);
  };
  workers.each(squares_.size(), count, haste);
}

SampleCount SampleCounts::of(const proto::TileAddress& tile) const {
  const std::int64_t units = lattice_.tile_units(tile.z), south = lattice_.south(tile) / proto::kTileCells,
                     squares = units / proto::kTileCells;
  std::int64_t west = lattice_.west(tile);
  while (west + units <= samples_west_) west += lattice_.columns();
  while (west >= samples_east_) west -= lattice_.columns();
  west = proto::floor_divide(west, proto::kTileCells);
  const std::int64_t rows = static_cast<std::int64_t>(squares_.size()) / across_;
  SampleCount sum;
  for (std::int64_t row = std::max(south, south_); row < std::min(south + squares, south_ + rows); ++row) {
    for (std::int64_t column = std::max(west, west_); column < std::min(west + squares, west_ + across_); ++column) {
      const SampleCount& count = squares_[static_cast<std::size_t>((row - south_) * across_ + column - west_)];
      sum.valid += count.valid, sum.flat += count.flat, sum.filled += count.filled;
      sum.lowest = std::min(sum.lowest, count.lowest), sum.highest = std::max(sum.highest, count.highest);
    }
  }
  return sum;
}

std::optional<EncodedTile> encode_tile(const LevelContext& context, const BuiltTile& built, const proto::BuildOptions& options) {
  // The finest level is held against the raster's pixels, which see what lies between samples.
  const bool finest = built.tile.z == context.lattice->finest_level;
  const std::vector<std::uint8_t> left_out =
      finest ? std::vector<std::uint8_t>() : rim_slivers(built.mesh, kMostLean * context.level->target());
  const PublishedMesh published = published_mesh(built.mesh, left_out);
  if (published.empty()) return std::nullopt;
  EncodedTile encoded{record_of(built), {}, {}};
  proto::TileRecord& record = encoded.record;
  count_mesh(built, published, record);
  EncodeInput input;
  input.lattice = context.lattice, input.tile = built.tile, input.mesh = &built.mesh;
  input.geometric_error_m = built.max_error_m;
  take_from_plan(input, published, *context.level, options);
  encoded.drc = encode_drc(input, published);
  record.set_drc_bytes(static_cast<std::uint32_t>(encoded.drc.size()));
  for (const double bound : tile_region(input, published)) record.add_region(bound);
  if (context.counts) set_counts(context.counts->of(built.tile), record);
  return encoded;
}

EncodedTile lost_tile(const proto::TileAddress& tile, const SampleCount& count) {
  EncodedTile lost{record_at(tile), {}, {}};
  set_counts(count, lost.record);
  lost.record.set_uncovered(count.valid);
  return lost;
}

std::vector<EncodedTile> without_gaps(std::vector<std::optional<EncodedTile>>& tiles) {
  std::vector<EncodedTile> those;
  for (std::optional<EncodedTile>& tile : tiles) {
    if (tile) those.push_back(std::move(*tile));
  }
  return those;
}

std::vector<EncodedTile> encode_tiles(const LevelContext& context, const std::vector<BuiltTile>& built,
                                      const proto::BuildOptions& options, Workers& workers, const std::atomic<bool>* stop) {
  std::vector<std::optional<EncodedTile>> made(built.size());
  workers.each(built.size(), [&](std::size_t k, unsigned) {
    if (!stop || !*stop) made[k] = encode_tile(context, built[k], options);
  });
  return without_gaps(made);
}

FinishedFinest finish_finest(const proto::Plan& plan, const LevelContext& context, BuiltTile& built,
                             const std::vector<raster::PixelPoint>& pixels, Measure measure, gpu::SurfaceMemory& memory) {
  FinishedFinest finished;
  TilePixels placed(*context.lattice, built.tile, built.mesh.side, pixels);
  bool changed = false;
  if (pixels_within_m(plan) > 0) {
    MetPixels met = meet_pixels(context, built, placed, memory);
    changed = met.changed;
    finished.on_sides = std::move(met.on_sides);
  }
  if (changed || measure == Measure::always) finished.above_m = measure_exact(context, built, memory);
  finished.tile = encode_tile(context, built, plan.options());
  if (finished.tile) *finished.tile->record.mutable_pixels() = placed.errors(built.mesh);
  return finished;
}

}  // namespace cordillera::pipeline
