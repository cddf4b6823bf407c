// Child processes of every temper, played by shell scripts.
#include "server/jobs/child.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>

#include "fixture.h"
#include "server/jobs/job_queue.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

TEST(AskedToStop, TheSecondTimeASignalEndsTheProcess) {
  constexpr int kNotAsked = 3, kStillThere = 4;
  EXPECT_EXIT(
      {
        stop_on({SIGINT, SIGTERM}, SecondTime::ends);
        std::raise(SIGTERM);
        if (!g_asked_to_stop) std::exit(kNotAsked);
        std::raise(SIGTERM);
        std::exit(kStillThere);
      },
      testing::KilledBySignal(SIGTERM), "");
}

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
            "job " + folder_.path().string() + " --parent " + std::to_string(getpid()) + " --free-percent 0\n");
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

TEST_F(Children, AreHeardEvenWhereTheySayTooMuch) {
  const auto outcome = run(R"(printf '{"stage":"","error":{"type":"unit-unknown","detail":"' >&3; )"
                           R"(head -c 3000000 /dev/zero | tr '\0' u >&3; echo '"}}' >&3; exit 1)");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.problem().type, "unit-unknown");
  EXPECT_LT(outcome.problem().detail.size(), 1000u);
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

TEST_F(Children, HaveASessionAndAnEnvironmentOfTheirOwn) {
  setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
  setenv("GDAL_CACHEMAX", "64", 1);
  setenv("TOLD_1", "one", 1), setenv("TOLD_2", "two", 1);
  setenv("CORDILLERA_JOB_ENVIRONMENT", "TOLD_1,TOLD_2,TOLD_3", 1);
  ASSERT_TRUE(run(R"(env > "$2/environment"; cat /proc/$$/stat > "$2/stat"; echo $$ > "$2/pid")"));
  for (const char* name : {"AWS_SECRET_ACCESS_KEY", "GDAL_CACHEMAX", "TOLD_1", "TOLD_2", "CORDILLERA_JOB_ENVIRONMENT"})
    unsetenv(name);
  const std::string environment = file_text(folder_.path() / "environment");
  EXPECT_THAT(environment, testing::AllOf(HasSubstr("GDAL_CACHEMAX=64\n"), HasSubstr("TOLD_1=one\n"), HasSubstr("TOLD_2=two\n")));
  EXPECT_THAT(environment, testing::Not(testing::AnyOf(HasSubstr("AWS_SECRET"), HasSubstr("CORDILLERA_JOB_ENVIRONMENT"),
                                                       HasSubstr("TOLD_3"))));
  std::istringstream stat(file_text(folder_.path() / "stat"));
  std::string pid, name, state, parent, group, session;
  stat >> pid >> name >> state >> parent >> group >> session;
  EXPECT_EQ(pid + "\n", file_text(folder_.path() / "pid"));
  EXPECT_EQ(group, pid);
  EXPECT_EQ(session, pid);
}

TEST_F(Children, SayLinesThatAreLoggedUpToALimit) {
  testing::internal::CaptureStdout();  // where lines go before a service says otherwise
  ASSERT_TRUE(run(R"(echo 'a plain line' >&2; echo 'and one to stdout'; printf 'no end, \033[31m' >&2)"));
  const std::string few = testing::internal::GetCapturedStdout();
  const std::string job = "job " + folder_.path().filename().string() + " says";
  EXPECT_THAT(few, testing::AllOf(HasSubstr(job + ": a plain line"), HasSubstr(job + ": and one to stdout"),
                                  HasSubstr(job + ": no end, ?[31m")));
  testing::internal::CaptureStdout();
  ASSERT_TRUE(run(R"(i=0; while [ $i -lt 20000 ]; do echo "line $i of many that are said" >&2; i=$((i+1)); done)"));
  const std::string many = testing::internal::GetCapturedStdout();
  EXPECT_THAT(many, testing::AllOf(HasSubstr("line 0 of"), HasSubstr(job + " more than 65536 bytes; the rest is left out")));
  EXPECT_LT(many.size(), 500'000u);
}

/// One that was taken over may close its report, stop its clock and go on.
TEST_F(Children, EndWhenTheirTimeIsOverWhateverTheyDo) {
  proto::Job job;
  job.set_max_seconds(1);
  std::ofstream(folder_.path() / kJobFile) << to_json_line(job);
  const auto outcome = run("trap '' TERM ALRM; while true; do sleep 0.1; done");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.problem().type, "build-time-limit");
}

/// Nothing that the service could follow is left of a job's temporary files.
TEST_F(Children, LeaveNoTemporaryFiles) {
  ASSERT_TRUE(run(R"(mkdir "$2/tmp"; ln -s /etc/passwd "$2/tmp/link"; echo kept > "$2/kept")"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / kTemporaryFolder));
  EXPECT_EQ(file_text(folder_.path() / "kept"), "kept\n");
}

TEST_F(Children, ThatCannotStartAreAProblem) {
  const auto outcome = child_runner("/no/such/program")(folder_.path(), nullptr, stop_);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.problem().type, "job-crashed") << "it is tried once more";
  EXPECT_THAT(outcome.problem().detail, HasSubstr("cannot be started: No such file or directory"));
}

TEST_F(Children, ThatCannotStartForWantOfDescriptorsAreTriedAgain) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  const auto outcome = child_runner("/bin/true")(folder_.path(), nullptr, stop_);
  setrlimit(RLIMIT_NOFILE, &before);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.problem().type, "service-busy") << "the raster is not to blame";
  EXPECT_TRUE(is_passing(outcome.problem(), 100));
  EXPECT_TRUE(child_runner("/bin/true")(folder_.path(), nullptr, stop_));
}

}  // namespace
}  // namespace cordillera::server
