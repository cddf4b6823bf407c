#include "pipeline/tile_output.h"

#include <algorithm>

#include "pipeline/encode.h"
#include "pipeline/published_mesh.h"

namespace cordillera::pipeline {
namespace {

constexpr double kSkirtTolerances = 4;  // both levels' border chains may be off by one, in opposite directions, two levels apart
constexpr double kSkirtSteps = 8;

/// Finest samples with data, and the flat ones among them; western and southern border only, so that tiles add up.
void count_samples(const LevelContext& context, const proto::TileAddress& tile, proto::TileRecord& record) {
  const proto::Lattice& lattice = *context.lattice;
  const proto::Samples& samples = *context.samples;
  const std::int64_t units = lattice.tile_units(tile.z);
  std::int64_t west = lattice.west(tile);
  while (west + units <= samples.west) west += lattice.columns();
  while (west >= samples.west + samples.columns) west -= lattice.columns();
  // The last row and column of the lattice's rectangle belong to the tile that ends there.
  const std::int64_t north = lattice.south(tile) + units + (lattice.south(tile) + units == lattice.rows() ? 1 : 0);
  std::uint32_t valid = 0, flat = 0;
  for (std::int64_t j = std::max(lattice.south(tile), samples.south); j < std::min(north, samples.south + samples.rows); ++j) {
    for (std::int64_t i = std::max(west, samples.west); i < std::min(west + units, samples.west + samples.columns); ++i) {
      const auto at = static_cast<std::size_t>((j - samples.south) * samples.columns + (i - samples.west));
      if (samples.height[at] == proto::kNoHeight) continue;
      ++valid;
      if (!samples.flat_water.empty()) flat += samples.flat_water[at];
    }
  }
  record.set_valid_samples(valid);
  record.set_flat_samples(flat);
  record.set_flat_water(valid > 0 && flat == valid);
}

}  // namespace

std::optional<EncodedTile> encode_tile(const LevelContext& context, const BuiltTile& built, const std::string& attribution) {
  const PublishedMesh published = published_mesh(built.mesh);
  if (published.empty()) return std::nullopt;
  EncodeInput input;
  input.lattice = context.lattice;
  input.tile = built.tile;
  input.mesh = &built.mesh;
  input.ecef_step_m = context.level->ecef_step();
  input.skirt_m = kSkirtTolerances * context.level->chain_tolerance() + kSkirtSteps * context.level->ecef_step();
  input.geometric_error_m = built.max_error_m;
  input.attribution = attribution;
  EncodedTile encoded;
  encoded.drc = encode_drc(input);
  encoded.glb = encode_glb(input);
  proto::TileRecord& record = encoded.record;
  record.set_level(static_cast<std::uint32_t>(built.tile.z));
  record.set_x(static_cast<std::uint32_t>(built.tile.x));
  record.set_y(static_cast<std::uint32_t>(built.tile.y));
  record.set_vertices(static_cast<std::uint32_t>(published.source.size()));
  record.set_triangles(static_cast<std::uint32_t>(published.triangles.size()));
  record.set_max_error(built.max_error_m);
  record.set_sum_squared_error(built.measured.sum_squared_m2);
  record.set_samples(built.measured.samples);
  record.set_composed(built.composed);
  record.set_uncovered(built.measured.uncovered);
  record.set_overcovered(built.measured.overcovered);
  record.set_drc_bytes(static_cast<std::uint32_t>(encoded.drc.size()));
  record.set_glb_bytes(static_cast<std::uint32_t>(encoded.glb.size()));
  record.set_put_back(built.put_back);
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
  std::uint32_t on_border = 0;
  for (const std::uint32_t v : published.source) {
    lowest = std::min(lowest, built.mesh.height[v]);
    highest = std::max(highest, built.mesh.height[v]);
    const std::int32_t x = built.mesh.x[v], y = built.mesh.y[v];
    on_border += x == 0 || y == 0 || x == built.mesh.side || y == built.mesh.side ? 1 : 0;
  }
  record.set_min_height(lowest * proto::kHeightStep_m);
  record.set_max_height(highest * proto::kHeightStep_m);
  record.set_border_vertices(on_border);
  for (const double bound : tile_region(input)) record.add_region(bound);
  if (context.samples) count_samples(context, built.tile, record);
  return encoded;
}

}  // namespace cordillera::pipeline
