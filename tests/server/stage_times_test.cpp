#include "server/stage_times.h"

#include <gmock/gmock.h>

#include <thread>

namespace cordillera::server {
namespace {

TEST(StageTimes, SaysEachStageOnceInTheirOrderAndAllOfThem) {
  StageTimes times;
  times.enter("open");
  times.enter("build");
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  times.enter("build");  // reports come many times a stage
  times.enter("publish");
  EXPECT_THAT(times.text(), testing::MatchesRegex("open 0\\.0. s, build 0\\.[0-9]+ s, publish 0\\.0. s; [0-9]+\\.[0-9]+ s in all"));
}

TEST(StageTimes, CountsFromAStagesFirstReport) {
  StageTimes times;
  times.enter("build");
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  times.enter("build");
  times.enter("publish");
  EXPECT_THAT(times.text(), testing::Not(testing::HasSubstr("build 0.00")));
}

}  // namespace
}  // namespace cordillera::server
