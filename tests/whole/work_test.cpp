// A build cut into tasks gives what a build in one piece gives.
#include <fstream>

#include "pipeline/faces/terrain.h"
#include "pipeline/plan/plan.h"
#include "pipeline/work/stage_memory.h"
#include "proto/version.h"
#include "tests/whole/work_fixture.h"

namespace cordillera::whole {
namespace {

TEST_F(Work, of_several_devices_gives_the_same_and_does_nothing_twice) {
  const Bytes whole = in_one_piece("whole.sqlite");
  devices_ = {"cpu", "cpu", "cpu"};
  const proto::WorkPlan plan = this->plan();
  all_stages(plan);
  int tasks = 0;
  for (const proto::WorkStage& stage : plan.stages()) tasks += stage.tasks_size();
  EXPECT_EQ(done_, tasks);
  ASSERT_TRUE(publish(plan, "tasks.sqlite").ok());
  EXPECT_EQ(published(folder_.path("tasks.sqlite")), whole);
}

TEST_F(Work, of_several_devices_ends_with_the_problem_of_the_first) {
  devices_ = {"no such device", "nor this"};
  const proto::WorkPlan plan = this->plan();
  const auto done = stage(plan, 0);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.problem().type, "unknown-device");
}

/// Its device is opened while the first block is read: no raster is to blame.
TEST_F(Work, of_exact_blocks_ends_with_the_problem_of_its_device) {
  request_.options.set_strategy("exact");
  examine({"west.tif", "beside.tif", "far.tif"});
  devices_ = {"no such device"};
  const proto::WorkPlan plan = this->plan();
  ASSERT_TRUE(plan.plan().exact());
  const auto done = stage(plan, 0);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.problem().type, "unknown-device");
  EXPECT_EQ(failed_, 0);
}

TEST_F(Work, in_tasks_gives_the_bytes_of_one_piece) {
  const proto::WorkPlan plan = this->plan();
  EXPECT_GT(plan.stages(0).tasks_size(), 2) << "all is one block: nothing to share out";
  EXPECT_EQ(plan.stages_size(), 2);
  all_stages(plan);
  const auto manifest = publish(plan, "tasks.sqlite");
  ASSERT_TRUE(manifest.ok()) << manifest.problem().line();
  EXPECT_EQ(manifest->sources_size(), 3);
  const Bytes tasks = published(folder_.path("tasks.sqlite"));
  EXPECT_GT(masks_in(tasks), 10u);
  expect_same(in_one_piece("piece.sqlite"), tasks);
}

/// Data lie along three quarters of the meridians, and a pole is one point of all of them.
void expect_one_height_at_the_pole(const std::string& path) {
  const pipeline::faces::Terrain terrain(std::move(pipeline::StoreReader::open(path)).value());
  const auto height_m = terrain.height_m(3, -180, 90);
  ASSERT_TRUE(height_m);
  for (const double longitude_deg : {-90.0, 1.5, 135.0, 180.0}) EXPECT_EQ(terrain.height_m(3, longitude_deg, 90), height_m);
  EXPECT_FALSE(terrain.height_m(3, 0, -90));
}

/// A block at a pole needs the raster that the pole's height is of, wherever that lies.
TEST_F(Work, rasters_that_meet_at_a_pole_give_the_bytes_of_one_piece) {
  constexpr proto::Lattice kCoarse{3};
  request_.options.set_max_level(kCoarse.finest_level);
  request_.options.set_error(300);
  request_.options.set_feather(0);
  request_.block_samples = 512 * 512;
  const std::int64_t quarter = kCoarse.columns() / 4;
  std::vector<std::string> names;
  for (int k = 0; k < 3; ++k) {
    names.push_back("polar-" + std::to_string(k) + ".tif");
    const auto rough_ground = rough(static_cast<std::uint32_t>(k));
    write(cells_of({kCoarse.finest_level, quarter * k, kCoarse.rows()}, static_cast<int>(quarter), 30,
                   [&](int c, int r) { return 500.0 * k + rough_ground(c, r); }),
          folder_.path(names.back()));
  }
  examine(names);
  const proto::WorkPlan plan = this->plan();
  EXPECT_GT(plan.stages(0).tasks_size(), 3) << "all is one block: nothing to share out";
  all_stages(plan);
  const auto manifest = publish(plan, "tasks.sqlite");
  ASSERT_TRUE(manifest.ok()) << manifest.problem().line();
  expect_same(in_one_piece("piece.sqlite"), published(folder_.path("tasks.sqlite")));
  expect_one_height_at_the_pole(folder_.path("tasks.sqlite"));
}

TEST_F(Work, a_plan_of_rasters_of_several_sizes_states_none_of_the_whole) {
  const proto::WorkPlan mixed = plan();
  EXPECT_EQ(mixed.source().columns(), 0u);
  EXPECT_EQ(mixed.source().rows(), 0u);
  examine({"west.tif", "beside.tif"});
  EXPECT_EQ(plan().source().columns(), 160u) << "that of each";
}

TEST_F(Work, parts_of_a_stage_are_all_of_it) {
  const proto::WorkPlan plan = this->plan();
  for (const std::size_t parts : {1u, 2u, 3u, 7u, 100u}) {
    std::vector<std::size_t> all;
    for (std::size_t part = 0; part < parts; ++part) {
      for (const std::size_t task : work::part_of(plan.stages(0), part, parts)) all.push_back(task);
    }
    ASSERT_EQ(all.size(), static_cast<std::size_t>(plan.stages(0).tasks_size()));
    for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(all[k], k);
  }
}

TEST_F(Work, levels_above_blocks_cost_by_these) {
  const proto::WorkPlan plan = this->plan();
  ASSERT_EQ(plan.stages_size(), 2);
  double samples = 0;
  for (const proto::WorkTask& block : plan.stages(0).tasks()) samples += work::cost_of(block);
  ASSERT_EQ(plan.stages(1).tasks_size(), 1);
  EXPECT_NEAR(plan.stages(1).tasks(0).cost(), samples / 6, 1e-6 * samples);
}

/// docs/operate/limits.md has what was seen.
TEST_F(Work, levels_above_blocks_take_memory_by_their_samples) {
  proto::WorkPlan plan;
  proto::Plan& numbers = *plan.mutable_plan();
  numbers.set_exact(true);
  numbers.set_finest_level(13);
  numbers.set_block_level(11);
  const auto above_mib = [&](int across, int up) {
    numbers.clear_window();
    for (const int side : {4097, 2049, 4096 + 1024 * across - 1, 2048 + 1024 * up - 1}) numbers.add_window(side);
    return work::memory_mib_of(plan, 1);
  };
  EXPECT_EQ(above_mib(4, 4), 1024u) << "the least";
  EXPECT_EQ(above_mib(32, 32), 2560u) << "a billion samples";
  EXPECT_EQ(above_mib(32, 33), 2048u) << "region by region";
  EXPECT_EQ(work::memory_mib_of(plan, 0), 1024u);
}

TEST_F(Work, a_merge_before_its_blocks_may_be_tried_again) {
  const auto early = stage(plan(), 1);
  ASSERT_FALSE(early.ok());
  EXPECT_EQ(early.problem().type, "shard-missing");
  EXPECT_TRUE(work::worth_retrying(early.problem()));
}

TEST_F(Work, a_publish_that_is_stopped_leaves_nothing_and_can_be_done_again) {
  const proto::WorkPlan plan = this->plan();
  all_stages(plan);
  const auto files = [this] { return std::distance(fs::directory_iterator(folder_.path(".")), fs::directory_iterator()); };
  const auto before = files();
  const auto stopped = publish(plan, "out.sqlite", true);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.problem().type, "cancelled");
  EXPECT_EQ(files(), before);
  EXPECT_TRUE(publish(plan, "out.sqlite").ok());
}

TEST_F(Work, what_is_missing_or_damaged_is_named_and_nothing_is_published) {
  const proto::WorkPlan plan = this->plan();
  all_stages(plan);
  const proto::WorkTask& task = plan.stages(0).tasks(1);
  const std::string shard = work::shard_path(shards_, task.key());
  fs::rename(shard, shard + ".away");
  auto refused = publish(plan, "out.sqlite");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "shards-missing");
  EXPECT_THAT(refused.problem().detail, testing::HasSubstr("stage 0 task 1"));
  fs::rename(shard + ".away", shard);
  constexpr std::streamoff kLengthOfTiles = 16;
  for (const auto& [at, from] : {std::pair(std::streamoff{-5}, std::ios::end), std::pair(kLengthOfTiles + 6, std::ios::beg)}) {
    {
      std::fstream file(shard, std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(at, from);
      file.put('x');
    }
    refused = publish(plan, "out.sqlite");
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.problem().type, "shard-damaged");
    EXPECT_FALSE(fs::exists(folder_.path("out.sqlite")));
    // A scheduler that is told what is done has it done again.
    const auto progress = work::progress_of(plan, shards_);
    ASSERT_TRUE(progress.ok());
    EXPECT_EQ((*progress)[0].done + 1, (*progress)[0].all);
    // Work makes it anew, and no other.
    done_ = 0;
    ASSERT_TRUE(stage(plan, 0).ok());
    EXPECT_EQ(done_, 1);
  }
  EXPECT_TRUE(publish(plan, "out.sqlite").ok());
  // A full disk may have room tomorrow.
  refused = publish(plan, "no such folder/out.sqlite");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "store-write");
  EXPECT_TRUE(work::worth_retrying(refused.problem()));
  EXPECT_TRUE(work::worth_retrying({"export-write", "", "", ""}));
}

TEST_F(Work, a_plan_of_another_version_is_refused) {
  proto::WorkPlan plan = this->plan();
  plan.mutable_plan()->set_program("cordillera 0.0.1");
  ASSERT_TRUE(work::write_plan(plan, shards_).ok());
  const auto read = work::read_plan(shards_);
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.problem().type, "plan-version");
  plan.mutable_plan()->set_program(proto::kProgram);
  plan.set_format(1);
  ASSERT_TRUE(work::write_plan(plan, shards_).ok());
  EXPECT_THAT(work::read_plan(shards_).problem().line(),
              testing::HasSubstr("has format 1; this program makes and takes format " + std::to_string(pipeline::kPlanFormat)));
}

TEST_F(Work, the_same_rasters_in_another_order_are_another_plan) {
  const std::string key = plan().stages(0).tasks(0).key();
  examine({"beside.tif", "west.tif", "far.tif"});
  bool differs = false;
  const proto::WorkPlan turned = plan();
  for (const proto::WorkTask& task : turned.stages(0).tasks()) differs = differs || task.key() != key;
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace cordillera::whole
