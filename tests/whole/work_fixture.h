#pragma once
// Three small rasters, and a plan of them that is done in tasks.
#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/shard.h"
#include "pipeline/work/work.h"
#include "pipeline/work/work_plan.h"
#include "tests/whole/built.h"
#include "tests/whole/bytes.h"

namespace cordillera::whole {

namespace fs = std::filesystem;
namespace work = pipeline::work;

constexpr int kLevel = 13;
/// Three small rasters: two that overlap, one so far away that it lies in other blocks.
class Work : public testing::Test {
 protected:
  Work() {
    write_patch("west.tif", 0, 0, 160, 70);
    write_patch("beside.tif", 110, -60, 160, 71);
    write_patch("far.tif", 9000, 6000, 140, 72);
    request_.raster_name = "three";
    request_.options = plain_options();
    request_.options.set_max_level(kLevel);
    request_.options.set_error(6);
    request_.options.set_feather(300);
    request_.options.set_water(kSea_m);
    examine({"west.tif", "beside.tif", "far.tif"});
  }
  void write_patch(const std::string& name, int east, int north, int side, std::uint32_t seed) {
    write(points_of({kLevel, 9008 * kTile + east, 6000 * kTile + north}, side, side, rough_with_sea(seed)), folder_.path(name));
  }
  void examine(const std::vector<std::string>& names) {
    request_.members.clear();
    for (const std::string& name : names) {
      auto member = raster::examine(folder_.path(name), name, raster::Trust::operator_file, request_.options);
      ASSERT_TRUE(member.ok()) << member.problem().line();
      request_.members.push_back(*member);
    }
  }
  Bytes in_one_piece(const std::string& name) {
    request_.store_path = folder_.path(name);
    const auto built = pipeline::build(request_, nullptr, never_);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return published(request_.store_path);
  }
  proto::WorkPlan plan() {
    auto plan = work::plan_work(request_, never_);
    EXPECT_TRUE(plan.ok()) << plan.problem().line();
    EXPECT_TRUE(work::write_plan(*plan, shards_).ok());
    auto read = work::read_plan(shards_);  // as a worker elsewhere has it
    EXPECT_TRUE(read.ok()) << read.problem().line();
    return *read;
  }
  proto::Result<void> stage(const proto::WorkPlan& plan, int number, std::size_t part = 0, std::size_t parts = 1) {
    const proto::WorkStage& stage = plan.stages(number);
    return work::do_tasks(
        plan, stage, work::part_of(stage, part, parts), {shards_, devices_, 2, 0, begin_},
        [this](const proto::WorkTask& task, work::TaskOutcome outcome) {
          ++(outcome == work::TaskOutcome::done ? done_ : outcome == work::TaskOutcome::failed ? failed_ : found_);
          order_.push_back(task.key());
          after_task_();
        },
        never_);
  }
  void all_stages(const proto::WorkPlan& plan) {
    for (int s = 0; s < plan.stages_size(); ++s) {
      const auto done = stage(plan, s);
      EXPECT_TRUE(done.ok()) << done.problem().line();
    }
  }
  proto::Result<proto::Manifest> publish(const proto::WorkPlan& plan, const std::string& name, bool stopped = false) {
    const std::atomic<bool> stop{stopped};
    return work::publish(plan, shards_, folder_.path(name), stop);
  }

  Folder folder_;
  std::string shards_ = folder_.path("plan");
  pipeline::BuildRequest request_;
  const std::atomic<bool> never_ = false;
  std::vector<std::string> devices_{"cpu"};
  int done_ = 0, found_ = 0, failed_ = 0;
  std::size_t begin_ = 0;
  std::vector<std::string> order_;  ///< keys of tasks as they ended
  std::function<void()> after_task_ = [] {};
};

}  // namespace cordillera::whole
