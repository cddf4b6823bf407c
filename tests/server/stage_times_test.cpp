#include "server/cli/stage_times.h"

#include <gmock/gmock.h>

#include <chrono>

namespace cordillera::server {
namespace {

using std::chrono::milliseconds;

TEST(StageTimes, SaysEachStageOnceInTheirOrderAndAllOfThem) {
  StageTimes::Clock::time_point now{};
  StageTimes times([&] { return now; });
  times.enter("open");
  now += milliseconds(20);
  times.enter("build");
  now += milliseconds(3000);
  times.enter("build");  // reports come many times a stage, which counts from the first
  now += milliseconds(100);
  times.enter("publish");
  now += milliseconds(210);
  EXPECT_EQ(times.text(), "open 0.02 s, build 3.10 s, publish 0.21 s; 3.33 s in all");
}

TEST(StageTimes, TheWallsClockGoesOn) {
  StageTimes times;
  times.enter("build");
  const auto start = StageTimes::Clock::now();
  while (StageTimes::Clock::now() - start < milliseconds(10)) {}
  times.enter("publish");
  EXPECT_THAT(times.text(), testing::Not(testing::HasSubstr("build 0.00")));
}

}  // namespace
}  // namespace cordillera::server
