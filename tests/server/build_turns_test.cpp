// Whose build is next, and how long it may take.
#include "server/jobs/build_turns.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/xattr.h>

#include <cerrno>
#include <mutex>
#include <thread>

#include "server/jobs/job_queue.h"
#include "tests/sanitized.h"
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
      if (k < gone)
        EXPECT_FALSE(turns.place(ids[k])) << ids[k];
      else
        EXPECT_EQ(turns.place(ids[k]), k - gone + 1) << ids[k] << " after " << gone;
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
int post(const Settings& settings, const JobRunner& runner, const std::string& body) {
  return TestService(settings, runner).post(body, {}, {{"prefer", "wait=600"}}).status;
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

/// A body that was compressed on its way is as large as what came.
TEST(BuildTime, GrowsWithWhatCameOfACodedBody) {
  TestService test;
  if (setxattr(test.folder().c_str(), "user.test", "x", 1, 0) != 0 && errno == ENOTSUP)
    GTEST_SKIP() << "the disk of temporary files keeps no extended attributes, so what came is not noted";
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.headers = {{"content-encoding", "gzip"}, {"transfer-encoding", "chunked"}};
  request.sent = std::make_shared<std::uint64_t>(0);
  request.read_body = [sent = request.sent](const Request::Sink& sink) {
    *sent = 1000;
    return sink("SLOW" + std::string(std::size_t{3} << 20, ' '));
  };
  const std::string id = posted_id(test.api().handle(request));
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(test.service().layout().dataset(id) / kJobFile); }));
  proto::Job job;
  job.set_raster(test.service().registry().find(id)->raster);
  EXPECT_EQ(bytes_of_rasters(test.service().layout().dataset(id), job), 1000U);
}

/// A raster that is read by ranges is as long as its server says, and hardly anything of it is there.
TEST(BuildTime, OfWhatWasNotFetchedIsNone) {
  TempFolder folder;
  const std::filesystem::path file = folder.path() / "source.tif";
  std::ofstream(file) << "GOOD";
  std::filesystem::resize_file(file, std::uintmax_t{1} << 30);
  proto::Job job;
  job.set_raster("source.tif");
  EXPECT_EQ(bytes_of_rasters(folder.path(), job), std::uint64_t{1} << 30) << "whole, on a disk that counts its blocks late";
  std::ofstream(map_of(file)) << "map";
  EXPECT_LT(bytes_of_rasters(folder.path(), job), std::uint64_t{1} << 20);
}

TEST(PassingTrouble, OfTheTablesIsTriedAgain) {
  std::atomic<int> tries{0};
  const auto runner = [&](const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop) {
    if (++tries == 1)
      return proto::Result<std::optional<proto::Estimate>>(proto::Problem{"crs-tables-unreadable", "an I/O error", "", ""});
    return play_job(folder, progress, stop);
  };
  EXPECT_EQ(post({}, runner, "GOOD"), 201);
  EXPECT_EQ(tries, 2);
}

/// The queue needs its first clock when no descriptor is left.
TEST(PassingTrouble, OfDescriptorsIsTriedAgain) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer opens a pipe when it meets an object of a type for the first time";
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  std::atomic<bool> posted{false};
  const auto runner = [&](const std::filesystem::path&, const ProgressSink&, const std::atomic<bool>&) {
    eventually([&] { return posted.load(); });
    const rlimit none{0, before.rlim_max};
    setrlimit(RLIMIT_NOFILE, &none);
    return proto::Result<std::optional<proto::Estimate>>(proto::Problem{"service-busy", "no descriptor is left", "", ""});
  };
  TestService test({}, runner);
  const std::shared_ptr<void> after(
      nullptr, [&](void*) { setrlimit(RLIMIT_NOFILE, &before); });  // first of all: a folder that is removed is opened
  EXPECT_EQ(test.post("GOOD").status, 202);
  posted = true;
  // The second attempt cannot even write what it is to do.
  EXPECT_TRUE(eventually([&] {
    const auto rows = test.service().registry().list();
    return rows.size() == 1 && rows[0]->problem && rows[0]->problem->type == "storage-full";
  }));
}

/// What was built of a version so far may be what is wrong. Meanwhile whoever asks is told what the change waits for.
TEST(PassingTrouble, AVersionThatCannotGoOnIsBegunAnew) {
  std::atomic<int> runs{0};
  const JobRunner runner = [&](const std::filesystem::path& folder, const ProgressSink&, const std::atomic<bool>&) -> JobOutcome {
    const auto store = folder / updates::kNextStore;
    if (runs++ == 0) std::ofstream(store) << "damaged";
    if (std::filesystem::exists(store)) return proto::Problem{"store-write", "the store is malformed", "", ""};
    return proto::Problem{"raster-unreadable", "an end", "", ""};
  };
  TestService test({}, runner);
  const Response posted = test.post("GOOD", {{"updates", "1"}, {"provisional", "off"}});
  ASSERT_EQ(posted.status, 202) << posted.bytes();
  Json last;
  EXPECT_TRUE(eventually([&] {
    last = body_of(test.get("/v1/datasets/" + posted_id(posted) + "/sources"))["changes"][0];
    return last["error"].is_object();
  }));
  EXPECT_EQ(last["state"], "pending");
  EXPECT_EQ(last["error"]["detail"], "the store is malformed");
  const Registry& registry = test.service().registry();
  ASSERT_TRUE(eventually([&] { return registry.list()[0]->state == State::failed || runs > 4; }));
  EXPECT_EQ(runs, 4) << "three with the same store";
  EXPECT_EQ(registry.list()[0]->state, State::failed);
}

TEST(PassingTrouble, EndsWhereItDoesNotPass) {
  const proto::Problem tables{"crs-tables-unreadable", "", "", ""};
  EXPECT_TRUE(is_passing(tables, 0));
  EXPECT_FALSE(is_passing(tables, 100)) << "an installation without tables";
  EXPECT_FALSE(is_passing({"crs-not-transformable", "", "", ""}, 0));
}

/// One client asks for many; another that comes behind waits for one of them.
TEST(DryTurns, GoFromClientToClient) {
  DryTurns turns(1);
  std::shared_ptr<void> running = turns.take("a0", "alice");
  ASSERT_TRUE(running);
  std::mutex mutex;
  std::string order;
  std::vector<std::thread> threads;
  const auto ask = [&](const std::string& id, const std::string& client) {
    threads.emplace_back([&, id, client] {
      const auto turn = turns.take(id, client);
      const std::lock_guard lock(mutex);
      order += turn ? id + " " : "";
    });
    ASSERT_TRUE(eventually([&] { return turns.waiting() == threads.size(); }));
  };
  for (const char* id : {"a1", "a2", "a3"}) ask(id, "alice");
  ask("b1", "bob");
  ask("c1", "carol");
  running.reset();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order, "a1 b1 c1 a2 a3 ");
}

TEST(DryTurns, EndWithTheService) {
  DryTurns turns(1);
  const std::shared_ptr<void> running = turns.take("a0", "alice");
  std::shared_ptr<void> other = running;
  std::thread waits([&] { other = turns.take("b0", "bob"); });
  EXPECT_TRUE(eventually([&] { return turns.waiting() == 1; }));
  turns.stop();
  waits.join();
  EXPECT_FALSE(other);
}

/// A flood of dry runs of one client, over HTTP: another's is second.
TEST(DryTurns, AreTheSendersOverHttp) {
  std::mutex mutex;
  std::vector<std::string> order;
  std::atomic<bool> go{false};
  const auto runner = [&](const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop) {
    proto::Job job;
    from_json(file_text(folder / kJobFile), &job);
    {
      const std::lock_guard lock(mutex);
      order.push_back(job.name());
    }
    eventually([&] { return go || stop; });
    return play_job(folder, progress, stop);
  };
  TempFolder folder;
  Settings settings;
  settings.serve.data = (folder.path() / "data").string();
  settings.serve.jobs = 1;
  auto service = Service::open(settings, runner);
  ASSERT_TRUE(service);
  Api api(**service);
  std::vector<std::thread> threads;
  const auto ask = [&](const std::string& name, const std::string& client) {
    threads.emplace_back([&api, name, client] {
      Request request;
      request.method = "POST";
      request.path = "/v1/datasets";
      request.client = client;
      request.query = {{"dry_run", "1"}, {"name", name}};
      request.headers = {{"content-length", "4"}};
      request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
      EXPECT_EQ(TestService::settled(api.handle(request)).status, 200);
    });
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return order.size() + (*service)->queue().waiting_dry_runs() == threads.size();
    }));
  };
  for (const char* name : {"a0", "a1", "a2", "a3"}) ask(name, "192.0.2.1");
  ask("b0", "192.0.2.2");
  go = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(order, (std::vector<std::string>{"a0", "a1", "b0", "a2", "a3"}));
}

/// What a job says of its files, whichever way their folder is named; over HTTP they have no place.
TEST(Places, OfTheOperatorsDiskAreNotTold) {
  TempFolder folder;
  std::filesystem::create_directory(folder.path() / "real");
  std::filesystem::create_symlink(folder.path() / "real", folder.path() / "link");
  Settings settings;
  settings.serve.data = (folder.path() / "link").string();
  const auto runner = [&](const std::filesystem::path& job, const ProgressSink&, const std::atomic<bool>&) -> JobOutcome {
    const std::string real = std::filesystem::canonical(job).string();
    return proto::Problem{"raster-unreadable",
                          "the store " + (job / kStoreFile).string() + " cannot be written: [" + real + "/x] in " + real,
                          "room in " + job.string(), ""};
  };
  auto service = Service::open(settings, runner);
  ASSERT_TRUE(service) << service.problem().line();
  Api api(**service);
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.headers = {{"content-length", "4"}, {"prefer", "wait=600"}};
  for (const char* dry : {"0", "1"}) {
    request.query = {{"dry_run", dry}};
    request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
    const Response answer = TestService::settled(api.handle(request));
    EXPECT_EQ(answer.body.find(folder.path().string()), std::string::npos) << answer.body;
    EXPECT_NE(answer.body.find("the store dataset.sqlite cannot be written: [x] in the job's folder"), std::string::npos)
        << answer.body;
  }
  Request list;
  list.path = "/v1/datasets";
  EXPECT_EQ(std::string(api.handle(list).bytes()).find(folder.path().string()), std::string::npos);
}

}  // namespace
}  // namespace cordillera::server
