// Whose build is next, and how long it may take.
#include "server/jobs/build_turns.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "server/jobs/job_queue.h"
#include "tests/server/fixture.h"

namespace cordillera::server {
namespace {

std::string order(BuildTurns& turns) {
  std::string all;
  while (const auto turn = turns.next()) all += (all.empty() ? "" : " ") + turn->id;
  return all;
}

TEST(BuildTurns, GoFromClientToClient) {
  BuildTurns turns;
  for (const char* id : {"a1", "a2", "a3"}) turns.add({id, "alice", 0});
  turns.add({"b1", "bob", 0});
  turns.add({"c1", "carol", 0});
  turns.add({"b2", "bob", 0});
  EXPECT_EQ(order(turns), "a1 b1 c1 a2 b2 a3");
  EXPECT_FALSE(turns.next());
}

TEST(BuildTurns, HaveADatasetOnceAndLetItComeBackAtTheEnd) {
  BuildTurns turns;
  EXPECT_TRUE(turns.add({"changed", "alice", 0}));
  EXPECT_FALSE(turns.add({"changed", "alice", 0})) << "a hundred changes of it are one place";
  turns.add({"other", "alice", 0});
  EXPECT_EQ(turns.next()->id, "changed");
  EXPECT_TRUE(turns.add({"changed", "alice", 0}));
  EXPECT_EQ(order(turns), "other changed");
}

TEST(BuildTurns, SayWhichPlaceSomebodyHas) {
  BuildTurns turns;
  for (const char* id : {"a1", "a2", "a3"}) turns.add({id, "alice", 0});
  turns.add({"b1", "bob", 0});
  turns.add({"c1", "carol", 0});
  turns.add({"b2", "bob", 0});
  const std::vector<std::string> ids = {"a1", "b1", "c1", "a2", "b2", "a3"};
  for (std::size_t gone = 0; gone < ids.size(); ++gone) {
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (k < gone) EXPECT_FALSE(turns.place(ids[k])) << ids[k];
      else EXPECT_EQ(turns.place(ids[k]), k - gone + 1) << ids[k] << " after " << gone;
    }
    turns.next();
  }
}

TEST(BuildTime, GrowsWithWhatWasSent) {
  const Limits limits;
  EXPECT_EQ(build_seconds(limits, 1100), 660U) << "1,100 bytes may be 144 million pixels";
  EXPECT_EQ(build_seconds(limits, std::uint64_t{20} << 20), 600U + 21 * 60);
  EXPECT_EQ(build_seconds(limits, std::uint64_t{1} << 40), limits.build_seconds);
  Limits brief;
  brief.build_seconds = 8;
  EXPECT_EQ(build_seconds(brief, 1100), 8U) << "the operator's own bound stands";
}

/// The status of a post that waits for its build by this runner.
int post(const Settings& given, const JobRunner& runner, const std::string& body) {
  TempFolder folder;
  Settings settings = given;
  settings.serve.data = (folder.path() / "data").string();
  auto service = Service::open(settings, runner);
  if (!service) throw std::runtime_error(service.problem().line());
  Api api(**service);
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.headers = {{"content-length", std::to_string(body.size())}, {"prefer", "wait=600"}};
  request.read_body = [&](const Request::Sink& sink) { return sink(body); };
  return TestService::settled(api.handle(request)).status;
}

TEST(BuildTime, IsToldToTheJob) {
  Settings settings;
  settings.serve.limits.build_base_seconds = 100;
  settings.serve.limits.build_seconds_per_mib = 10;
  std::atomic<std::uint32_t> told{0};
  const auto runner = [&](const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop) {
    proto::Job job;
    from_json(file_text(folder / kJobFile), &job);
    told = job.max_seconds();
    return play_job(folder, progress, stop);
  };
  EXPECT_EQ(post(settings, runner, "GOOD" + std::string(std::size_t{3} << 20, ' ')), 201);
  EXPECT_EQ(told, 140U);
}

TEST(PassingTrouble, OfTheTablesIsTriedAgain) {
  std::atomic<int> tries{0};
  const auto runner = [&](const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop) {
    if (++tries == 1) return proto::Result<std::optional<proto::Estimate>>(proto::Problem{"crs-tables-unreadable", "an I/O error", "", ""});
    return play_job(folder, progress, stop);
  };
  EXPECT_EQ(post({}, runner, "GOOD"), 201);
  EXPECT_EQ(tries, 2);
}

/// The queue needs its first clock when no descriptor is left.
TEST(PassingTrouble, OfDescriptorsIsTriedAgain) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  std::atomic<bool> posted{false};
  const auto runner = [&](const std::filesystem::path&, const ProgressSink&, const std::atomic<bool>&) {
    eventually([&] { return posted.load(); });
    const rlimit none{0, before.rlim_max};
    setrlimit(RLIMIT_NOFILE, &none);
    return proto::Result<std::optional<proto::Estimate>>(proto::Problem{"service-busy", "no descriptor is left", "", ""});
  };
  TempFolder folder;
  Settings settings;
  settings.serve.data = (folder.path() / "data").string();
  auto service = Service::open(settings, runner);
  ASSERT_TRUE(service);
  Api api(**service);
  const std::shared_ptr<void> after(nullptr, [&](void*) { setrlimit(RLIMIT_NOFILE, &before); });  // first of all: a folder that is removed is opened
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.headers = {{"content-length", "4"}};
  request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
  EXPECT_EQ(api.handle(request).status, 202);
  posted = true;
  // The second attempt cannot even write what it is to do.
  EXPECT_TRUE(eventually([&] {
    const auto rows = (*service)->registry().list();
    return rows.size() == 1 && rows[0]->problem && rows[0]->problem->type == "storage-full";
  }));
}

TEST(PassingTrouble, EndsWhereItDoesNotPass) {
  const proto::Problem tables{"crs-tables-unreadable", "", "", ""};
  EXPECT_TRUE(is_passing(tables, 0));
  EXPECT_FALSE(is_passing(tables, 100)) << "an installation without tables";
  EXPECT_FALSE(is_passing({"crs-not-transformable", "", "", ""}, 0));
}

}  // namespace
}  // namespace cordillera::server
