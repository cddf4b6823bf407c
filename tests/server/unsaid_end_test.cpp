// Services that end without saying so while something is built: killed, or out of memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"
#include "server/jobs/underway.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class UnsaidEnd : public testing::Test {
 protected:
  static Settings two_jobs() {
    Settings settings;
    settings.serve.jobs = 2;
    return settings;
  }
  Row row(const std::string& id) { return test_.service().registry().find(id); }
  bool is_built(const std::string& id) { return test_.service().hub().now(id).progress.has_value(); }
  std::string post() {
    const std::string id = posted_id(test_.post("SLOW"));
    EXPECT_TRUE(eventually([&] { return is_built(id); }));
    return id;
  }
  /// The service works on meanwhile: what goes while it is copied is gone.
  static void copy_what_is_there(const fs::path& from, const fs::path& to) {
    fs::create_directories(to);
    std::error_code gone;
    for (const auto& entry : fs::directory_iterator(from, gone)) {
      const fs::path copy = to / entry.path().filename();
      if (entry.is_directory(gone))
        copy_what_is_there(entry.path(), copy);
      else
        fs::copy_file(entry.path(), copy, gone);
    }
  }
  /// What is on the disk at this moment is all that a service finds that starts after a kill.
  void kill() {
    const fs::path aside = test_.folder() / "aside";
    copy_what_is_there(test_.data(), aside);
    test_.stop();
    fs::remove_all(test_.data());
    fs::rename(aside, test_.data());
    test_.start();
  }

  TestService test_{two_jobs()};
};

TEST_F(UnsaidEnd, ThreeWithoutAStepAheadFailABuild) {
  const std::string id = post();
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(eventually([&] { return is_built(id); })) << k;
    kill();
  }
  ASSERT_TRUE(eventually([&] { return row(id)->state == State::failed; }));
  EXPECT_EQ(row(id)->problem->type, "job-crashed");
  EXPECT_THAT(row(id)->problem->detail, HasSubstr("killed 3 times"));
  EXPECT_TRUE(eventually([&] { return !fs::exists(Layout{test_.data()}.dataset(id)); }));
}

TEST_F(UnsaidEnd, AStopIsNone) {
  const std::string id = post();
  for (int k = 0; k < 5; ++k) {
    test_.stop();
    test_.start();
    ASSERT_TRUE(eventually([&] { return is_built(id); })) << k;
  }
  EXPECT_EQ(row(id)->state, State::running);
}

TEST_F(UnsaidEnd, FailsNoneOfThoseThatWaited) {
  const std::string one = post(), two = post(), waits = posted_id(test_.post("GOOD"));
  for (int k = 0; k < 2; ++k) {
    ASSERT_TRUE(eventually([&] { return is_built(one) && is_built(two); })) << k;
    kill();
  }
  // It may have been for the one or for the other: they have their last try one after the other.
  ASSERT_TRUE(eventually([&] { return is_built(one) || is_built(two); }));
  ASSERT_TRUE(eventually([&] { return row(waits)->state == State::ready; })) << "there is a turn for others meanwhile";
  EXPECT_FALSE(is_built(one) && is_built(two));
  kill();
  ASSERT_TRUE(eventually([&] { return test_.service().registry().counts().failed == 1; }));
  EXPECT_TRUE(eventually([&] { return is_built(row(one)->state == State::failed ? two : one); }));
  EXPECT_EQ(test_.service().registry().counts().failed, 1u);
}

/// A build that gets on between two ends will come to its end.
TEST(UnsaidEnds, AreCountedAnewWhereSomethingWasBuilt) {
  const TempFolder folder;
  const fs::path said = folder.path() / kUnderWayFile, aside = folder.path() / "aside";
  const std::atomic<bool> never{false};
  const auto killed_at = [&](const std::string& stage, double done) {
    const JobRunner runner = noting_ends([&](const fs::path&, const ProgressSink& told, const std::atomic<bool>&) -> JobOutcome {
      proto::Progress now;
      for (const auto& [name, much] : {std::pair<std::string, double>("open", 0), {stage, done}, {stage, done + 100}}) {
        now.set_stage(name);
        now.set_done(much);
        told(now);
      }
      fs::copy_file(said, aside);
      return std::optional<proto::Estimate>();
    });
    EXPECT_TRUE(runner(
        folder.path(), [](const proto::Progress&) {}, never));
    fs::rename(aside, said);  // as a kill would have left it
    return unsaid_ends(folder.path());
  };
  EXPECT_EQ(killed_at("build", 0), 1u);
  EXPECT_EQ(killed_at("build", 0), 2u);
  EXPECT_EQ(killed_at("build", 100), 1u) << "it goes on behind what was built";
  EXPECT_EQ(killed_at("build", 100), 2u);
  EXPECT_EQ(killed_at("merge", 0), 1u);
  EXPECT_EQ(killed_at("merge", 0), 2u);
  EXPECT_EQ(killed_at("build", 200), 3u) << "what it has begun anew";
  forget_unsaid_ends(folder.path());
  EXPECT_EQ(unsaid_ends(folder.path()), 0u);
}

}  // namespace
}  // namespace cordillera::server
