// What a person reads on a terminal: progress and tables.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "server/cli/commands.h"
#include "server/cli/progress_bar.h"

namespace cordillera::server {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

proto::Progress progress(const std::string& stage, double done, double total, double seconds_left) {
  proto::Progress now;
  now.set_stage(stage);
  now.set_done(done);
  now.set_total(total);
  now.set_seconds_left(seconds_left);
  return now;
}

TEST(Tables, ProgressIsShareAndTime) {
  EXPECT_EQ(progress_text(progress("build", 532879, 761256, 80)), "build 69 %, 1 min 20 s left") << "never 100 % before the end";
  EXPECT_EQ(progress_text(progress("build", 1, 4, -1)), "build 25 %") << "nobody knows how long";
  EXPECT_EQ(progress_text(progress("build", 4, 4, 0)), "build 100 %");
  EXPECT_EQ(progress_text(progress("open", 0, 1, -1)), "open");
  EXPECT_EQ(duration_text(0.2), "less than a second");
  EXPECT_EQ(duration_text(59.4), "59 s");
  EXPECT_EQ(duration_text(7500), "2 h 5 min");
}

/// What a log gets of a build whose progress is told 1000 times.
std::string log_of(ProgressBar::Style style) {
  testing::internal::CaptureStderr();
  ProgressBar bar(style);
  bar.show(progress("open", 0, 1, -1));
  for (int i = 0; i <= 1000; ++i) bar.show(progress("build", i, 1000, -1));
  for (int i = 0; i < 50; ++i) bar.show(progress("publish", i % 2, 1, -1));
  bar.finish();
  return testing::internal::GetCapturedStderr();
}

TEST(Tables, ALogGetsALineForEachStageAndTenth) {
  const std::string log = log_of(ProgressBar::Style::lines);
  EXPECT_EQ(std::count(log.begin(), log.end(), '\n'), 13) << log;
  EXPECT_THAT(log, HasSubstr("open\nbuild 0 %\nbuild 10 %\n"));
  EXPECT_THAT(log, HasSubstr("build 100 %\npublish\n"));
  EXPECT_EQ(log_of(ProgressBar::Style::none), "");
}

TEST(Tables, WhatIsOverSoonIsNotTold) {
  using namespace std::chrono_literals;
  ProgressBar::Clock::time_point now{};
  testing::internal::CaptureStderr();
  {
    ProgressBar bar(ProgressBar::Style::lines, 1s, [&] { return now; });
    bar.show(progress("export", 0, 1000, -1));
    now += 999ms;
    bar.show(progress("export", 300, 1000, -1));
    now += 1ms;
    bar.show(progress("export", 370, 1000, -1));
    bar.show(progress("export", 380, 1000, -1));
    bar.show(progress("export", 1000, 1000, -1));
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "export 37 %\nexport 100 %\n");
}

proto::Manifest manifest() {
  proto::Manifest manifest;
  manifest.set_device("cpu");
  proto::LevelSummary& measured = *manifest.add_levels();
  measured.set_level(1);
  measured.set_tiles(1);
  measured.set_target(5);
  measured.set_stated_max_error(4.5);
  measured.set_rmse(0);
  proto::LevelSummary& bound = *manifest.add_levels();
  bound.set_target(9);
  bound.set_tiles(1);
  bound.set_stated_max_error(9.5);
  bound.set_composed(true);
  return manifest;
}

TEST(Tables, ABoundHasNoRmse) {
  const std::string table = manifest_table(manifest());
  EXPECT_THAT(table, ContainsRegex("4\\.500 +0\\.000\n")) << "a measured 0 is a 0";
  EXPECT_THAT(table, ContainsRegex("9\\.500\\* +-\n"));
  EXPECT_THAT(table, HasSubstr("built on cpu"));
}

TEST(Tables, ALevelThatShowsNothingHasNoError) {
  proto::Manifest hidden = manifest();
  hidden.mutable_levels(1)->set_tiles(0);
  hidden.mutable_levels(1)->clear_stated_max_error();
  EXPECT_THAT(manifest_table(hidden), ContainsRegex("9\\.000 +-\\* +-\n"));
}

TEST(Tables, AStrategyIsNamed) {
  proto::Manifest chosen = manifest();
  chosen.mutable_options()->set_strategy("cleap");
  chosen.add_notes("a note");
  const std::string lines = "strategy  cleap\nnote      a note\n";
  EXPECT_THAT(manifest_table(chosen), HasSubstr(lines));
  EXPECT_THAT(estimate_table(chosen, 90), HasSubstr(lines));
}

TEST(Tables, AnEstimateStatesNoErrors) {
  proto::Manifest estimate = manifest();
  for (proto::LevelSummary& level : *estimate.mutable_levels()) level.clear_stated_max_error();
  estimate.mutable_options()->set_threads(2);
  const std::string table = estimate_table(estimate, 90);
  EXPECT_THAT(table, HasSubstr("1 min 30 s on 2 threads"));
  EXPECT_THAT(table, HasSubstr("guess"));
  EXPECT_THAT(table, ContainsRegex(" 5\\.000\n"));
  EXPECT_THAT(table, Not(HasSubstr(" 0.000")));
  EXPECT_THAT(table, Not(HasSubstr("rmse")));
  EXPECT_THAT(table, Not(HasSubstr("max error")));
  estimate.mutable_options()->add_keep(0.5);
  EXPECT_THAT(estimate_table(estimate, 90), Not(HasSubstr("5.000"))) << "a share has no target before it is built";
}

}  // namespace
}  // namespace cordillera::server
