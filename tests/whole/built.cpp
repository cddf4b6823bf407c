#include "tests/whole/built.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipeline/build/build.h"
#include "pipeline/encode/decode.h"
#include "pipeline/plan/plan.h"

namespace cordillera::whole {
namespace {

template <class T>
T must(proto::Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.problem().type + ": " + result.problem().line());
  return std::move(*result);
}

BuiltTile decode(const pipeline::StoreReader& store, const proto::TileRecord& record) {
  const proto::TileAddress at{static_cast<int>(record.level()), static_cast<std::int32_t>(record.x()),
                              static_cast<std::int32_t>(record.y())};
  BuiltTile tile{{at, 0, {}, {}, {}, {}}, {}, record};
  const auto drc_bytes = store.tile(at, pipeline::Encoding::drc), glb_bytes = store.tile(at, pipeline::Encoding::glb);
  if (!drc_bytes || !glb_bytes) throw std::runtime_error("a record without its tile");
  const pipeline::DecodedDrc drc = must(pipeline::decode_drc(drc_bytes->bytes));
  if (proto::TileAddress{drc.z, drc.x, drc.y} != at) throw std::runtime_error("a tile that names another place");
  tile.drc.side = drc.side;
  const auto steps = static_cast<std::int32_t>(std::lround(drc.height_step * 1024));
  for (const auto& [u, v, h] : drc.points) tile.drc.u.push_back(u), tile.drc.v.push_back(v), tile.drc.h.push_back(h * steps);
  tile.drc.triangles = drc.triangles;
  const pipeline::DecodedGlb glb = must(pipeline::decode_glb(glb_bytes->bytes));
  for (const proto::Vec3& p : glb.points) tile.glb.points.push_back({p.x, p.y, p.z});
  tile.glb.triangles = glb.triangles;
  return tile;
}

void plan_again(Built& built, raster::Source& source, const pipeline::BuildRequest& request) {
  built.plan = must(pipeline::plan_of(request, source));
  built.lattice = pipeline::lattice_of(built.plan);
  for (int k = 0; k < built.plan.levels_size(); ++k) {
    built.plan.mutable_levels(k)->set_target(built.manifest.levels(k).tolerance());
    pipeline::derive_level(built.plan, *built.plan.mutable_levels(k));
  }
}

std::int64_t turn(const DecodedTile& t, std::uint32_t a, std::uint32_t b, std::int64_t u, std::int64_t v) {
  return (std::int64_t{t.u[b]} - t.u[a]) * (v - t.v[a]) - (std::int64_t{t.v[b]} - t.v[a]) * (u - t.u[a]);
}

/// The triangles whose box in plan, three times as large, holds (u, v).
DecodedTile near(const DecodedTile& t, std::int64_t u, std::int64_t v) {
  DecodedTile some = t;
  std::erase_if(some.triangles, [&](const auto& c) {
    const auto [west, east] = std::minmax({t.u[c[0]], t.u[c[1]], t.u[c[2]]});
    const auto [south, north] = std::minmax({t.v[c[0]], t.v[c[1]], t.v[c[2]]});
    const std::int32_t room = std::max(east - west, north - south);
    return u < west - room || u > east + room || v < south - room || v > north + room;
  });
  return some;
}

}  // namespace

std::optional<double> Built::truth(std::int64_t i, std::int64_t j) const {
  if (i < samples.west || i >= samples.west + samples.columns) {
    const std::int64_t circle = lattice.columns();
    i = samples.west + ((i - samples.west) % circle + circle) % circle;
  }
  if (j < samples.south || j >= samples.south + samples.rows || i >= samples.west + samples.columns) return std::nullopt;
  const std::int32_t height = samples.at(i, j);
  if (height == proto::kNoHeight) return std::nullopt;
  return height * proto::kHeightStep_m;
}

std::size_t Built::triangles(int level) const {
  std::size_t sum = 0;
  for (const auto& [at, tile] : levels.at(level)) sum += tile.drc.triangles.size();
  return sum;
}

double Built::stated_m(int level) const {
  double most = 0;
  for (const auto& [at, tile] : levels.at(level)) most = std::max(most, tile.record.max_error());
  return most;
}

proto::BuildOptions plain_options() {
  proto::BuildOptions options;
  options.set_vertical_datum("ellipsoid");
  options.set_threads(2);
  options.set_device("cpu");
  options.set_voids("hole");  // most of what is tested here is holes
  return options;
}

proto::BuildOptions with_error(double error_m) {
  proto::BuildOptions options = plain_options();
  options.set_error(error_m);
  return options;
}

proto::BuildOptions exact(double error_m) {
  proto::BuildOptions options = with_error(error_m);
  options.set_strategy("exact");
  return options;
}

Built build_file(const std::string& path, const proto::BuildOptions& options, std::int64_t block_samples,
                 std::int32_t quarter_side) {
  const Folder folder;
  pipeline::BuildRequest request;
  request.raster_path = path;
  request.raster_name = std::filesystem::path(path).filename().string();
  request.id = "test";
  request.store_path = folder.path("test.cordillera");
  request.options = options;
  request.block_samples = block_samples;
  request.quarter_side = quarter_side;
  const std::atomic<bool> stop = false;
  Built built;
  built.manifest = must(pipeline::build(request, nullptr, stop));
  auto source = must(pipeline::open_source(request));
  plan_again(built, *source, request);
  source = pipeline::source_of_tiles(built.plan, std::move(source));
  const auto& w = built.plan.window();
  built.samples = must(source->sample(built.lattice, w[0], w[1], w[2] - w[0] + 1, w[3] - w[1] + 1));
  const auto store = must(pipeline::StoreReader::open(request.store_path));
  for (const proto::LevelPlan& level : built.plan.levels()) {
    const int z = static_cast<int>(level.level());
    Level& tiles = built.levels[z];
    for (const proto::TileRecord& record : store->records(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      BuiltTile tile = decode(*store, record);
      tiles.emplace(tile.drc.tile, std::move(tile));
    }
  }
  return built;
}

Built build_dem(const Dem& dem, proto::BuildOptions options, std::int64_t block_samples, std::int32_t quarter_side) {
  if (dem.level) options.set_max_level(static_cast<std::uint32_t>(*dem.level));
  const Folder folder;
  write(dem, folder.path("dem.tif"));
  return build_file(folder.path("dem.tif"), options, block_samples, quarter_side);
}

std::optional<double> error_at(const Built& built, int level, std::int64_t i, std::int64_t j, double expected_m) {
  for (const auto& [at, tile] : built.levels.at(level)) {
    const std::int64_t circle = built.lattice.columns(), west = built.lattice.west(at);
    const std::int64_t here = west + ((i - west) % circle + circle) % circle;
    if (here > west + built.lattice.tile_units(level)) continue;
    const DecodedTile some = near(tile.drc, here - west, j - built.lattice.south(at));
    const Measured measured = measure(
        surface_of(some), built.lattice, at, [&](std::int64_t, std::int64_t) { return std::optional(expected_m); },
        {here, j, here, j}, 1);
    if (measured.samples > 0) return measured.max_m;
  }
  return std::nullopt;
}

bool covered(const BuiltTile& tile, const proto::Lattice& lattice, std::int64_t i, std::int64_t j) {
  const DecodedTile& t = tile.drc;
  const std::int64_t circle = lattice.columns();
  const std::int64_t u = ((i - lattice.west(t.tile)) % circle + circle) % circle, v = j - lattice.south(t.tile);
  if (u > t.side || v < 0 || v > t.side) return false;
  return std::any_of(t.triangles.begin(), t.triangles.end(), [&](const auto& c) {
    return turn(t, c[0], c[1], u, v) >= 0 && turn(t, c[1], c[2], u, v) >= 0 && turn(t, c[2], c[0], u, v) >= 0;
  });
}

bool covered(const Built& built, int level, std::int64_t i, std::int64_t j) {
  const Level& tiles = built.levels.at(level);
  return std::any_of(tiles.begin(), tiles.end(), [&](const auto& entry) { return covered(entry.second, built.lattice, i, j); });
}

}  // namespace cordillera::whole
