// Child processes of every temper, played by shell scripts.
#include "server/child.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

class Children : public testing::Test {
 protected:
  proto::Result<std::optional<proto::Estimate>> run(const std::string& script) {
    const auto program = folder_.path() / "program";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    chmod(program.c_str(), 0755);
    return child_runner(program.string())(
        folder_.path(),
        [this](const proto::Progress& now) {
          seen_.push_back(now);
          if (now.stage() == "stop me") stop_ = true;
        },
        stop_);
  }
  TempFolder folder_;
  std::vector<proto::Progress> seen_;
  std::atomic<bool> stop_{false};
};

TEST_F(Children, ReportAndSucceed) {
  const auto outcome =
      run(R"(echo '{"stage":"build","done":1,"total":2}' >&3; echo 'no json' >&3; echo '{"stage":"pub' >&3; exit 0)");
  EXPECT_TRUE(outcome);
  ASSERT_EQ(seen_.size(), 1u);
  EXPECT_EQ(seen_[0].stage(), "build");
}

TEST_F(Children, GetTheFolderAndTheParent) {
  const auto outcome = run("echo \"$@\" > \"$2/arguments\"; ls /proc/$$/fd > \"$2/descriptors\"");
  ASSERT_TRUE(outcome);
  EXPECT_EQ(file_text(folder_.path() / "arguments"),
            "job " + folder_.path().string() + " --parent " + std::to_string(getpid()) + "\n");
  EXPECT_THAT(file_text(folder_.path() / "descriptors"), HasSubstr("0\n1\n"));
}

TEST_F(Children, InheritNoSockets) {
  const int open_descriptor = fcntl(0, F_DUPFD, 100);  // as an accepted connection would be
  const auto outcome = run("if [ -e /proc/$$/fd/" + std::to_string(open_descriptor) + " ]; then kill -SEGV $$; fi");
  close(open_descriptor);
  EXPECT_TRUE(outcome) << "the child holds our descriptor";
}

TEST_F(Children, FailWithTheirProblem) {
  const auto outcome = run(R"(echo '{"error":{"type":"raster-unreadable","detail":"no"}}' >&3; exit 1)");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.problem().type, "raster-unreadable");
}

TEST_F(Children, CrashAndAreNamed) {
  const auto crashed = run("kill -SEGV $$");
  ASSERT_FALSE(crashed);
  EXPECT_EQ(crashed.problem().type, "job-crashed");
  EXPECT_THAT(crashed.problem().detail, HasSubstr("SIGSEGV"));
  EXPECT_THAT(run("exit 7").problem().detail, HasSubstr("exit code 7"));
  EXPECT_EQ(run(R"(echo '{"error":{"type":"x"}}' >&3; exit 0)").ok(), true) << "the exit code decides";
}

TEST_F(Children, AnswerDryRuns) {
  const auto outcome = run(R"(echo '{"estimate":{"seconds":4,"manifest":{"tiles":5}}}' >&3)");
  ASSERT_TRUE(outcome && *outcome);
  EXPECT_EQ((*outcome)->manifest().tiles(), 5u);
}

TEST_F(Children, EndWhenTheyAreAskedAndWhenTheyAreNot) {
  const std::string ready = R"(echo '{"stage":"stop me"}' >&3; )";
  for (const std::string& script : {ready + "exec sleep 600", "trap '' TERM; " + ready + "while true; do sleep 0.1; done"}) {
    stop_ = false;
    const auto start = std::chrono::steady_clock::now();
    const auto outcome = run(script);
    ASSERT_FALSE(outcome);
    EXPECT_EQ(outcome.problem().type, "cancelled");
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(300)) << "it ended by itself";
  }
}

TEST_F(Children, ThatCannotStartAreAProblem) {
  const auto outcome = child_runner("/no/such/program")(folder_.path(), nullptr, stop_);
  EXPECT_FALSE(outcome);
}

}  // namespace
}  // namespace cordillera::server
