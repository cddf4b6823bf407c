// Whether a raster at an address is read where it stands or copied: what the request says of it, and what the operator.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <vector>

#include "fixture.h"
#include "raster_host.h"
#include "server/datasets/dataset_folder.h"
#include "server/fetch/print.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// What the operator said of build=; empty: nothing. Nobody answers at the address.
Settings told(const std::string& build) {
  Settings settings;
  settings.serve.source_allow = {"http://127.0.0.1:1/"};
  if (!build.empty()) settings.build.set_build(build);
  return settings;
}

/// "there" is lazy, "copied" is not, unless it says otherwise; or a problem with the parameter that it names.
std::string made(TestService& test, Given query) {
  query.emplace_back("source", "http://127.0.0.1:1/dem.tif");
  const Response answer = test.post("", query);
  const Json said = body_of(answer);
  if (answer.status != 202) return slug_of(answer) + " " + said.value("parameter", "");
  const auto row = test.service().registry().find(said.value("id", ""));
  if (!row->address.empty()) return is_lazy(*row) ? "there" : "there, full";
  return is_lazy(*row) ? "copied, lazy" : "copied";
}

/// What becomes of an address that is posted, once that has failed; null: it has not.
Row posted_until_failed(Service& service, const std::string& address) {
  Api api(service);
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.query = {{"source", address}};
  request.headers = {{"content-length", "0"}};
  const std::string id = body_of(api.handle(request)).value("id", "");
  Row row;
  const bool failed = eventually([&] { return (row = service.registry().find(id)) && row->state == State::failed; });
  return failed ? row : nullptr;
}

/// What came of a query where the operator said nothing, full and lazy.
struct Case {
  Given query;
  std::string without, full, lazy;
};

TEST(PostedAddress, IsReadWhereItStandsUnlessItIsToBeCopied) {
  const std::string conflict = "options-conflict ";
  const Case cases[] = {
      {{}, "there", "copied", "there"},
      {{{"updates", "0"}}, "there", "there", "there"},
      {{{"updates", "1"}}, "copied", "copied", "copied, lazy"},
      {{{"build", "lazy"}}, "there", "there", "there"},
      {{{"build", "full"}}, "copied", "copied", "copied"},
      {{{"build", "lazy"}, {"updates", "1"}}, "copied, lazy", "copied, lazy", "copied, lazy"},
      {{{"build", "full"}, {"updates", "0"}}, conflict + "source", conflict + "source", conflict + "source"},
      {{{"keep", "0.5"}}, "copied", "copied", "copied"},
      {{{"provisional", "0"}}, "copied", "copied", "copied"},
      {{{"keep", "0.5"}, {"updates", "0"}}, conflict + "source", conflict + "source", conflict + "source"},
      {{{"dry_run", "1"}}, conflict + "updates", conflict + "updates", conflict + "updates"},
      {{{"keep", "0.5"}, {"build", "lazy"}}, conflict + "build", conflict + "build", conflict + "build"},
      {{{"dry_run", "1"}, {"build", "lazy"}}, conflict + "dry_run", conflict + "dry_run", conflict + "dry_run"},
  };
  TestService without(told("")), full(told("full")), lazy(told("lazy"));
  for (const Case& row : cases) {
    std::string words;
    for (const auto& [name, value] : row.query) words += name + "=" + value + " ";
    EXPECT_EQ(made(without, row.query), row.without) << words;
    EXPECT_EQ(made(full, row.query), row.full) << words;
    EXPECT_EQ(made(lazy, row.query), row.lazy) << words;
  }
}

TEST(PostedAddress, IsCopiedWhereTheOperatorWantsNoProvisionalTiles) {
  Settings settings = told("");
  settings.build.set_provisional(false);
  TestService test(settings);
  EXPECT_EQ(made(test, {}), "copied");
  EXPECT_EQ(made(test, {{"provisional", "1"}}), "there");
}

/// A view of a GeoPackage may compute rows without an end.
TEST(PostedAddress, OfAListThatIsNotReadInAMinuteIsAProblem) {
  RasterHost host;
  host.has("/list.json", "{}");
  TempFolder folder;
  Settings settings;
  settings.serve.source_allow = {host.address() + "/"};
  settings.serve.data = (folder.path() / "data").string();
  std::atomic<std::uint32_t> told{0};
  auto service = Service::open(settings, [&](const fs::path& place, const ProgressSink&, const std::atomic<bool>&) {
    proto::Job job;
    from_json(file_text(place / kJobFile), &job);
    if (job.list()) told = job.max_seconds();
    return proto::Result<std::optional<proto::Estimate>>(proto::Problem{"build-time-limit", "too long", "", ""});
  });
  ASSERT_TRUE(service) << service.problem().line();
  const Row row = posted_until_failed(**service, host.address() + "/list.json");
  ASSERT_TRUE(row);
  EXPECT_EQ(told, updates::kListSeconds);
  EXPECT_EQ(row->problem->type, "sources-invalid") << row->problem->line();
  EXPECT_THAT(row->problem->detail, testing::HasSubstr("take longer to list than 60 seconds"));
}

/// What a job reads by ranges comes while it runs, and hardly anything of it is there when its time is measured out.
TEST(PostedAddress, HasTheTimeOfWhatCameSinceItBegan) {
  RasterHost host;
  constexpr std::size_t kBytes = std::size_t{8} << 20, kHalf = kBytes / 2;
  host.has_parts("/dem.tif", std::string("II*\0", 4) + std::string(kBytes, 'x'), "\"one\"");
  TempFolder folder;
  Settings settings;
  settings.serve.source_allow = {host.address() + "/"};
  settings.serve.data = (folder.path() / "data").string();
  std::mutex mutex;
  std::vector<std::uint32_t> told;
  auto service = Service::open(settings, [&](const fs::path& place, const ProgressSink&, const std::atomic<bool>&) -> JobOutcome {
    proto::Job job;
    from_json(file_text(place / kJobFile), &job);
    if (job.dry_run()) return std::optional<proto::Estimate>();
    const std::lock_guard lock(mutex);
    told.push_back(job.max_seconds());
    if (told.size() == 1) {
      std::fstream file(place / job.raster(), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(kHalf) << std::string(kHalf, 'x');
    }
    return proto::Problem{"build-time-limit", "too long", "", ""};
  });
  ASSERT_TRUE(service) << service.problem().line();
  const Row row = posted_until_failed(**service, host.address() + "/dem.tif");
  ASSERT_TRUE(row);
  EXPECT_EQ(row->problem->type, "build-time-limit") << row->problem->line();
  const std::lock_guard lock(mutex);
  ASSERT_EQ(told.size(), 2u) << "once more for the 4 MiB that came, and no more when none came";
  EXPECT_GE(told[1], told[0] + 3 * settings.serve.limits.build_seconds_per_mib);
}

/// One host that does not answer keeps no other from being asked, and is not asked for the same twice at once.
TEST(PostedAddress, IsAskedForAgainThoughAnotherHostHangs) {
  TestService test;
  std::mutex mutex;
  std::map<std::string, int> asked;
  std::atomic<bool> hangs{true};
  LiveCache live({test.service().layout(), test.service().registry(), test.service().queue(), test.service().admission(),
                  test.service().metrics(),
                  [&](const std::string& address, const updates::Print&, const std::function<bool()>& stopped) {
                    {
                      const std::lock_guard lock(mutex);
                      ++asked[address];
                    }
                    eventually([&] { return !hangs || stopped() || !address.starts_with("https://slow/"); });
                    return updates::Still::same;
                  },
                  0, 100, [](const std::string&) {}, std::chrono::seconds(0)});
  const auto dataset = [&](const std::string& id, const std::string& address) {
    updates::Print print;
    print.etag = "\"one\"";
    Dataset made;
    made.id = id;
    made.address = address;
    made.state = State::ready;
    made.raster = "source.tif";
    fs::create_directories(test.service().layout().dataset(id));
    std::ofstream(test.service().layout().dataset(id) / "source.tif") << "GOOD";
    std::ofstream(test.service().layout().dataset(id) / kFetchedFile) << updates::print_json(print);
    EXPECT_TRUE(test.service().registry().add(made));
    test.service().registry().set_state(id, State::ready, std::nullopt);
    return made;
  };
  const auto times = [&](const std::string& address) {
    const std::lock_guard lock(mutex);
    return asked[address];
  };
  const Dataset quick = dataset("quick", "https://quick/a.tif");
  std::vector<Dataset> slow;
  for (int k = 0; k < 8; ++k) slow.push_back(dataset("slow" + std::to_string(k), "https://slow/" + std::to_string(k) + ".tif"));
  for (int round = 0; round < 3; ++round)
    for (const Dataset& one : slow) live.note_read(one, "");
  for (int round = 1; round <= 3; ++round) {
    live.note_read(quick, "");
    ASSERT_TRUE(eventually([&] {
      live.note_read(quick, "");
      return times(quick.address) >= round;
    }));
  }
  hangs = false;
  for (const Dataset& one : slow) EXPECT_TRUE(eventually([&] { return times(one.address) == 1; })) << one.address;
}

/// A key that was used without a word of build= is that of build=lazy, and not of a copy.
TEST(PostedAddress, IsOneWithItsKey) {
  TestService test(told(""));
  const auto post = [&](const Given& more) {
    Given query = more;
    query.emplace_back("source", "http://127.0.0.1:1/dem.tif");
    return test.post("", query, {{"idempotency-key", "dem"}});
  };
  const std::string id = body_of(post({})).value("id", "");
  EXPECT_EQ(body_of(post({})).value("id", ""), id);
  EXPECT_EQ(body_of(post({{"build", "lazy"}})).value("id", ""), id);
  EXPECT_EQ(slug_of(post({{"updates", "1"}})), "idempotency-key-reused");
  EXPECT_EQ(slug_of(post({{"build", "full"}})), "idempotency-key-reused");
}

}  // namespace
}  // namespace cordillera::server
