// Provisional tiles and final ones of done blocks in one dataset: each is what its own build made, and nothing is missing between
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <tuple>

#include "pipeline/build/block_order.h"
#include "pipeline/build/provisional.h"
#include "pipeline/build/sharpen.h"
#include "pipeline/faces/map_window.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "tests/whole/built.h"

namespace cordillera::whole {
namespace {

using pipeline::Encoding;
using proto::TileAddress;

/// Keeps what it is told of.
struct Blocks : pipeline::BlockFollower {
  std::vector<TileAddress> looked_at() override { return looked; }
  bool shows(const TileAddress& block) override {
    return std::any_of(done.begin(), done.end(), [&](const pipeline::FinishedTask& task) { return task.node == block; });
  }
  void begin(const proto::Plan& of, std::function<void()>) override { plan = of; }
  void take(pipeline::FinishedTask&& block) override {
    block.mesh.reset();
    if (!block.tiles.empty()) done.push_back(std::move(block));
  }
  void end() override { ended = true; }
  bool waits_for_finest(const TileAddress&) override { return true; }
  void take_finest(const TileAddress& block, const std::vector<pipeline::EncodedTile>& tiles) override {
    const std::lock_guard lock(mutex);
    EXPECT_TRUE(finest.emplace(block, tiles).second && !shows(block)) << "before the block, and once";
  }
  proto::Plan plan;
  std::mutex mutex;
  std::map<TileAddress, std::vector<pipeline::EncodedTile>> finest;
  std::vector<pipeline::FinishedTask> done;
  std::vector<TileAddress> looked;
  bool ended = false;
};

/// Wants blocks only where it looks.
struct Lazy final : Blocks {
  bool lazy() const override { return true; }
  bool others_wait() override { return ++asked > alone_for; }
  int asked = 0, alone_for = 0;
};

/// Of a raster that is written into the folder.
pipeline::BuildRequest request_of(const Folder& folder, const Dem& dem, const proto::BuildOptions& options) {
  write(dem, folder.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder.path("dem.tif");
  request.raster_name = "dem.tif";
  request.options = options;
  return request;
}

class Sharpen : public testing::Test {
 protected:
  void SetUp() override {
    request_ = request_of(folder_, points_of(kCorner, 2300, 1300, rough_with_sea(8)), with_error(60));
    request_.id = "test";
    request_.options.set_max_level(13);
    request_.options.set_water(kSea_m);
    request_.block_samples = 1025 * 1025;
    request_.follower = &blocks_;
    request_.store_path = folder_.path("final");
    ASSERT_TRUE(pipeline::build(request_, nullptr, never_).ok());
    const auto source = pipeline::open_source(request_);
    ASSERT_TRUE(source.ok());
    auto small = pipeline::provisional_request(request_, **source, 300'000);  // level 11, a sixteenth
    ASSERT_TRUE(small.ok() && *small);
    (*small)->store_path = folder_.path("provisional");
    (*small)->follower = nullptr;
    (*small)->block_samples = 0;
    ASSERT_TRUE(pipeline::build(**small, nullptr, never_).ok());
  }
  std::unique_ptr<pipeline::StoreReader> opened(const std::string& name) const {
    auto reader = pipeline::StoreReader::open(folder_.path(name));
    EXPECT_TRUE(reader.ok()) << reader.problem().line();
    return reader.ok() ? std::move(reader).value() : nullptr;
  }
  static std::set<TileAddress> tiles_of(const pipeline::StoreReader& store, int z) {
    std::set<TileAddress> tiles;
    for (const auto& record : store.records_of(z)) tiles.insert(pipeline::address_of(record));
    return tiles;
  }
  void put(const std::vector<pipeline::FinishedTask>& done, const std::string& from, const std::string& to) const {
    const auto put = pipeline::put_done_blocks(folder_.path(from), blocks_.plan, done, folder_.path(to));
    ASSERT_TRUE(put.ok()) << put.problem().line();
  }

  /// Else a client that replaces a tile by its children would show holes.
  static void expect_all_children_or_none(const pipeline::StoreReader& final, const pipeline::StoreReader& now) {
    for (int z = 0; z < 13; ++z) {
      const auto below = tiles_of(now, z + 1);
      for (const TileAddress& tile : tiles_of(now, z)) {
        std::size_t with_data = 0, there = 0;
        for (int c = 0; c < 4; ++c) {
          with_data += final.record(tile.child(c)) ? 1 : 0;
          there += below.contains(tile.child(c)) ? 1 : 0;
        }
        EXPECT_TRUE(there == 0 || there >= with_data)
            << "of " << z << "/" << tile.x << "/" << tile.y << " there are " << there << " of " << with_data;
      }
    }
  }

  Folder folder_;
  pipeline::BuildRequest request_;
  Blocks blocks_;
  const std::atomic<bool> never_ = false;
};

TEST_F(Sharpen, done_blocks_have_their_final_tiles_and_the_rest_stays) {
  ASSERT_TRUE(blocks_.ended);
  ASSERT_GE(blocks_.done.size(), 6u);
  ASSERT_TRUE(pipeline::can_show_blocks(blocks_.plan, opened("provisional")->manifest()));
  const std::vector<pipeline::FinishedTask> first(blocks_.done.begin(), blocks_.done.begin() + 3),
      second(blocks_.done.begin() + 3, blocks_.done.begin() + 5);
  put(first, "provisional", "a");
  put(second, "a", "b");
  const auto final = opened("final"), before = opened("provisional"), now = opened("b");
  const int block_level = static_cast<int>(blocks_.plan.block_level());
  std::set<TileAddress> done;
  for (std::size_t k = 0; k < 5; ++k) done.insert(blocks_.done[k].node);
  const auto is_done = [&](const TileAddress& tile) {
    return tile.z >= block_level && done.contains(tile.at_level(block_level));
  };
  EXPECT_TRUE(now->manifest().provisional());
  EXPECT_EQ(now->manifest().max_level(), 13u);
  for (int k = 0; k < 4; ++k)
    EXPECT_EQ(now->manifest().bounds(k), before->manifest().bounds(k)) << "those of the whole, not of what is done";
  EXPECT_LE(now->manifest().bounds(4), before->manifest().bounds(4));
  EXPECT_GE(now->manifest().bounds(5), before->manifest().bounds(5));
  std::size_t final_tiles = 0, provisional_tiles = 0, final_masks = 0, provisional_masks = 0;
  for (int z = 0; z <= 13; ++z) {
    std::set<TileAddress> expected;
    for (const TileAddress& tile : tiles_of(*final, z)) {
      if (is_done(tile)) expected.insert(tile);
    }
    for (const TileAddress& tile : tiles_of(*before, z)) {
      if (!is_done(tile)) expected.insert(tile);
    }
    const auto there = tiles_of(*now, z);
    EXPECT_EQ(there, expected) << "level " << z;
    for (const TileAddress& tile : there) {
      const std::string mask = now->water(tile);
      EXPECT_EQ(mask, (is_done(tile) ? *final : *before).water(tile));
      (is_done(tile) ? final_masks : provisional_masks) += mask.empty() ? 0 : 1;
      if (!is_done(tile)) {
        ++provisional_tiles;
        continue;
      }
      ++final_tiles;
      EXPECT_EQ(now->tile(tile, Encoding::drc)->bytes, final->tile(tile, Encoding::drc)->bytes);
      EXPECT_EQ(now->tile(tile, Encoding::glb)->bytes, final->tile(tile, Encoding::glb)->bytes);
    }
  }
  EXPECT_GT(final_tiles, 20u);
  EXPECT_GT(provisional_tiles, 10u);
  EXPECT_GT(final_masks, 10u);
  EXPECT_GT(provisional_masks, 5u);
  expect_all_children_or_none(*final, *now);
}

/// Who waits for a tile of the finest level need not wait for the rest of its block.
TEST_F(Sharpen, the_finest_level_of_a_block_comes_before_the_block) {
  const auto final = opened("final");
  std::size_t tiles = 0;
  for (const pipeline::FinishedTask& block : blocks_.done) {
    std::set<TileAddress> expected, came;
    for (const pipeline::EncodedTile& tile : block.tiles) {
      if (tile.record.level() == 13) expected.insert(pipeline::address_of(tile.record));
    }
    for (const pipeline::EncodedTile& tile : blocks_.finest[block.node]) came.insert(pipeline::address_of(tile.record));
    EXPECT_EQ(came, expected);
    tiles += came.size();
  }
  EXPECT_GT(tiles, 20u);
  const TileAddress node = blocks_.done.front().node;
  const auto put = pipeline::put_finest(folder_.path("provisional"), blocks_.plan, {node, blocks_.finest[node], {}, {}},
                                        folder_.path("finest"));
  ASSERT_TRUE(put.ok()) << put.problem().line();
  const auto finest = opened("finest");
  for (const TileAddress& tile : tiles_of(*finest, 13)) {
    for (const Encoding encoding : {Encoding::drc, Encoding::glb})
      EXPECT_EQ(finest->tile(tile, encoding)->bytes, final->tile(tile, encoding)->bytes);
  }
  EXPECT_EQ(tiles_of(*finest, 13).size(), blocks_.finest[node].size());
}

/// What a level does not show yet, a coarser one does: nowhere a hole, and heights of done blocks are those of the final tiles.
TEST_F(Sharpen, heights_come_from_the_finest_level_that_is_there) {
  put({blocks_.done.begin(), blocks_.done.begin() + 3}, "provisional", "now");
  const pipeline::faces::Terrain final{opened("final")}, before{opened("provisional")}, now{opened("now")};
  const auto& b = final.manifest().bounds();
  const int block_level = static_cast<int>(blocks_.plan.block_level());
  int in_done = 0, beside = 0;
  for (int k = 1; k < 40; ++k) {
    for (int l = 1; l < 40; ++l) {
      const double longitude = b[0] + (b[2] - b[0]) * k / 40.0 + 1e-7, latitude = b[1] + (b[3] - b[1]) * l / 40.0 + 1e-7;
      const double per_deg = proto::tiles_up(block_level) / 180.0;
      const TileAddress node{block_level, static_cast<std::int32_t>((longitude + 180) * per_deg),
                             static_cast<std::int32_t>((latitude + 90) * per_deg)};
      const bool done =
          std::any_of(blocks_.done.begin(), blocks_.done.begin() + 3, [&](const auto& task) { return task.node == node; });
      const auto expected = done ? final.height_m(13, longitude, latitude) : before.height_m(11, longitude, latitude);
      const auto height = now.height_m(13, longitude, latitude);
      ASSERT_TRUE(expected && height) << longitude << " " << latitude;
      EXPECT_NEAR(*height, *expected, 1e-6);
      ++(done ? in_done : beside);
    }
  }
  EXPECT_GT(in_done, 100);
  EXPECT_GT(beside, 100);
  pipeline::faces::MapWindow window;
  window.zoom = 14, window.level = 13, window.columns = window.rows = 64;
  window.west = static_cast<std::int64_t>(pipeline::faces::longitude_pixel(14, (b[0] + b[2]) / 2)) - 32;
  window.north = static_cast<std::int64_t>(pipeline::faces::latitude_pixel(14, (b[1] + b[3]) / 2)) - 32;
  ASSERT_TRUE(pipeline::faces::draw_heights(now, window).ok());
  for (const double height_m : window.height_m) ASSERT_FALSE(std::isnan(height_m)) << "pictures have no holes either";
}

/// Of larger rasters blocks are larger, too, and lie a level farther up, or two.
TEST(Provisional, tiles_with_as_many_samples_as_are_said_meet_the_blocks) {
  const Folder folder;
  pipeline::BuildRequest request = request_of(folder, points_of(kCorner, 330, 230, rough(8)), exact(60));
  std::set<int> levels_below;
  for (const std::uint32_t finest : {17u, 18u, 20u, 21u}) {
    request.options.set_max_level(finest);
    const auto source = pipeline::open_source(request);
    ASSERT_TRUE(source.ok());
    const auto plan = pipeline::plan_of(request, **source);
    ASSERT_TRUE(plan.ok() && pipeline::has_levels_above(*plan)) << finest;
    const auto blocks = pipeline::block_level_of(request, **source);
    ASSERT_TRUE(blocks.ok() && blocks->has_blocks_to_show);
    const auto level = pipeline::provisional_level(request, **source, blocks->samples);
    ASSERT_TRUE(level.ok() && *level) << finest;
    EXPECT_EQ(**level, static_cast<int>(plan->block_level())) << finest;
    levels_below.insert(static_cast<int>(finest - plan->block_level()));
  }
  EXPECT_EQ(levels_below, (std::set<int>{2, 3, 4}));
  request.options.clear_error();
  request.options.set_strategy("");
  request.options.add_keep(0.3);
  const auto source = pipeline::open_source(request);
  ASSERT_TRUE(source.ok());
  const auto plan = pipeline::plan_of(request, **source);
  ASSERT_TRUE(plan.ok()) << plan.problem().line();
  const auto blocks = pipeline::block_level_of(request, **source);
  ASSERT_TRUE(blocks.ok()) << blocks.problem().line();
  const auto level = pipeline::provisional_level(request, **source, blocks->samples);
  ASSERT_TRUE(level.ok() && *level);
  EXPECT_EQ(**level, static_cast<int>(plan->block_level())) << "of shares, too";
}

/// Of a part of a raster: as many pixels a degree as without a bbox, and none beside it.
TEST(Provisional, of_a_bbox_are_that_part) {
  const Folder folder;
  const auto hills = [](int c, int r) { return 500 + 200 * std::sin(c / 90.0) * std::cos(r / 70.0); };
  pipeline::BuildRequest request = request_of(folder, points_of(kCorner, 1400, 1100, hills), with_error(4));
  const double cell_deg = proto::Lattice{kCorner.level}.cell_deg();
  const auto longitude = [&](int c) { return static_cast<double>(kCorner.west + c) * cell_deg - 180; };
  const auto latitude = [&](int r) { return static_cast<double>(kCorner.north - r) * cell_deg - 90; };
  for (const double side : {longitude(700), latitude(900), longitude(1300), latitude(200)}) request.options.add_bbox(side);
  const auto source = pipeline::open_source(request);
  ASSERT_TRUE(source.ok()) << source.problem().line();
  auto small = pipeline::provisional_request(request, **source, 40'000);
  ASSERT_TRUE(small.ok()) << small.problem().line();
  ASSERT_TRUE(*small) << "a part has them, too";
  (*small)->store_path = folder.path("provisional");
  const std::atomic<bool> never = false;
  const auto built = pipeline::build(**small, nullptr, never);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  EXPECT_TRUE(built->provisional());
  const pipeline::faces::Terrain terrain(std::move(pipeline::StoreReader::open(folder.path("provisional"))).value());
  const int level = static_cast<int>(built->max_level());
  for (const auto& [c, r] : {std::pair(800, 300), std::pair(1000, 500), std::pair(1200, 800)}) {
    const auto height_m = terrain.height_m(level, longitude(c), latitude(r));
    ASSERT_TRUE(height_m) << c << " " << r;
    EXPECT_NEAR(*height_m, hills(c, r), 40) << c << " " << r;
  }
  EXPECT_FALSE(terrain.height_m(level, longitude(400), latitude(500))) << "beside the bbox";
}

/// What is looked at is made first, whatever its place in the list.
TEST(BlockOrder, blocks_that_are_looked_at_come_first) {
  const std::vector<TileAddress> blocks{{5, 1, 1}, {5, 2, 1}, {5, 3, 1}, {5, 4, 1}};
  Blocks follower;
  pipeline::BlockOrder order(blocks, &follower);
  EXPECT_EQ(order.next(), 0u);
  follower.looked = {{3, 0, 0}, {7, 13, 5}, {6, 8, 2}};  // of many blocks, under 3/1, under 4/1
  EXPECT_EQ(order.next(), 2u);
  EXPECT_EQ(order.next(), 3u);
  EXPECT_EQ(order.next(), 1u);
}

TEST(BlockOrder, those_that_are_looked_at_are_given_once) {
  Blocks follower;
  pipeline::BlockOrder order({{5, 1, 1}, {5, 2, 1}, {5, 3, 1}}, &follower);
  EXPECT_TRUE(order.looked_at(9).empty());
  follower.looked = {{6, 6, 2}, {7, 13, 5}, {5, 1, 1}};
  EXPECT_EQ(order.looked_at(1), std::vector<std::size_t>{2});
  EXPECT_EQ(order.looked_at(9), std::vector<std::size_t>{0}) << "two tiles are of one block";
  EXPECT_TRUE(order.looked_at(9).empty());
}

TEST(BlockOrder, all_blocks_under_a_root_come_behind_those_that_are_looked_at) {
  Blocks follower;
  pipeline::BlockOrder order({{5, 1, 1}, {5, 2, 1}, {5, 40, 1}, {5, 4, 1}}, &follower);
  follower.looked = {{2, 0, 0}};
  EXPECT_TRUE(order.looked_at(9).empty()) << "a map that is zoomed out";
  follower.looked = {{0, 0, 0}, {5, 4, 1}};
  EXPECT_EQ(order.looked_at(9), (std::vector<std::size_t>{3, 0, 1})) << "5/40/1 is east of Greenwich";
}

/// Blocks by and by, over several processes: in the end the same bytes as at once.
TEST_F(Sharpen, a_lazy_build_makes_the_blocks_that_are_looked_at) {
  const std::vector<pipeline::FinishedTask>& all = blocks_.done;
  const auto build = [&](Lazy& follower) {
    request_.follower = &follower;
    request_.store_path = folder_.path("lazy");
    const auto built = pipeline::build(request_, nullptr, never_);
    EXPECT_TRUE(follower.ended);
    return built.ok() ? std::string("ready") : built.problem().type;
  };
  Lazy nobody;
  EXPECT_EQ(build(nobody), "paused");
  EXPECT_TRUE(nobody.done.empty());
  Lazy alone;  // the next look may come soon
  alone.alone_for = 20;
  EXPECT_EQ(build(alone), "paused");
  EXPECT_EQ(alone.asked, 21) << "it waits for looks until another build waits for its end";
  Lazy first;
  first.looked = {pipeline::address_of(all[2].tiles.back().record)};
  EXPECT_EQ(build(first), "paused");
  ASSERT_EQ(first.done.size(), 1u);
  EXPECT_EQ(first.done[0].node, all[2].node);
  Lazy later;  // a process that ended before it had shown what it made
  EXPECT_EQ(build(later), "paused");
  ASSERT_EQ(later.done.size(), 1u);
  EXPECT_EQ(later.done[0].node, all[2].node);
  ASSERT_EQ(later.done[0].tiles.size(), all[2].tiles.size());
  const auto less = [](const pipeline::EncodedTile& a, const pipeline::EncodedTile& b) {
    return std::tuple(a.record.level(), a.record.y(), a.record.x()) < std::tuple(b.record.level(), b.record.y(), b.record.x());
  };
  std::vector<pipeline::EncodedTile> expected = all[2].tiles, read = later.done[0].tiles;
  std::sort(expected.begin(), expected.end(), less);
  std::sort(read.begin(), read.end(), less);
  for (std::size_t k = 0; k < read.size(); ++k) EXPECT_EQ(read[k].drc, expected[k].drc);
  EXPECT_EQ(later.done[0].water.size(), all[2].water.size());
  Lazy rest;
  for (const pipeline::FinishedTask& block : all) rest.looked.push_back(block.node);
  for (const TileAddress& node : pipeline::touched_tiles(blocks_.plan, static_cast<int>(blocks_.plan.block_level())))
    rest.looked.push_back(node);
  std::string ended = "paused";  // after a turn, which a slow machine does not do all of them in
  while (ended == "paused") ended = build(rest);
  EXPECT_EQ(ended, "ready");
  const auto at_once = opened("final"), by_and_by = opened("lazy");
  for (int z = 0; z <= 13; ++z) {
    const auto tiles = tiles_of(*at_once, z);
    EXPECT_EQ(tiles_of(*by_and_by, z), tiles);
    for (const TileAddress& tile : tiles) {
      EXPECT_EQ(by_and_by->tile(tile, Encoding::drc)->etag, at_once->tile(tile, Encoding::drc)->etag);
      EXPECT_EQ(by_and_by->water(tile), at_once->water(tile));
    }
  }
}

TEST_F(Sharpen, left_alone_are_one_piece_and_a_pyramid_that_ends_above_the_blocks) {
  proto::Manifest coarse = opened("provisional")->manifest();
  proto::Plan one_piece = blocks_.plan;
  one_piece.set_block_level(one_piece.min_level());
  EXPECT_FALSE(pipeline::can_show_blocks(one_piece, coarse));
  coarse.set_max_level(blocks_.plan.block_level() - 1);
  EXPECT_FALSE(pipeline::can_show_blocks(blocks_.plan, coarse));
  EXPECT_FALSE(pipeline::can_show_blocks(blocks_.plan, opened("final")->manifest()));
}

/// Their errors, at samples and at pixels, are those of few samples.
TEST(Provisional, nothing_is_noted_of_their_errors) {
  const Folder folder;
  const pipeline::BuildRequest request = request_of(folder, points_of(kCorner, 1400, 1100, rough_with_sea(8)), with_error(4));
  const auto source = pipeline::open_source(request);
  ASSERT_TRUE(source.ok()) << source.problem().line();
  auto small = pipeline::provisional_request(request, **source, 40'000);
  ASSERT_TRUE(small.ok() && *small);
  (*small)->store_path = folder.path("provisional");
  const std::atomic<bool> never = false;
  const auto built = pipeline::build(**small, nullptr, never);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  ASSERT_GT(built->source().error_at_pixels().max(), 1.25 * built->levels(0).target()) << "there is nothing to note";
  for (const std::string& note : built->notes()) EXPECT_EQ(note.find("farther from"), note.npos) << note;
}

}  // namespace
}  // namespace cordillera::whole
