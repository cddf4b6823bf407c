// Archives over HTTP: what may be asked for, and what is kept of them.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "built_sample.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/store/sqlite.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

TEST(Archive, WhatIsNoFormatIsNamed) {
  const auto refused = [](const std::vector<std::pair<std::string, std::string>>& query) {
    Request request;
    request.path = built().base() + ".pmtiles";
    request.query = query;
    return slug_of(built().api().handle(request));
  };
  EXPECT_EQ(refused({{"form", "drc"}}), "option-unknown");
  EXPECT_EQ(refused({{"format", "tif"}}), "option-invalid");
  EXPECT_EQ(refused({{"format", "drc"}, {"format", "hillshade"}}), "option-repeated");
}

/// What a dataset is said to have can be fetched: maps in Web Mercator end at 85 degrees.
TEST(Polar, HasNoMaps) {
  const std::string base = built().post("ncols 2\nnrows 2\nxllcorner 10\nyllcorner 86\ncellsize 0.1\n1 2\n3 4\n",
                                        {{"name", "polar.asc"}, {"crs", "EPSG:4326"}, {"vertical-datum", "ellipsoid"}});
  const auto get = [&](const std::string& path) {
    Request request;
    request.path = path;
    return TestService::settled(built().api().handle(request));
  };
  const Json status = body_of(get(base)), faces = status["faces"],
             assets = body_of(get("/stac/collections/datasets/items" + base.substr(12)))["assets"];
  EXPECT_TRUE(assets.contains("3d-tiles")) << assets;
  EXPECT_FALSE(assets.contains("terrain-rgb")) << assets;
  EXPECT_FALSE(assets.contains("contours")) << assets;
  EXPECT_FALSE(assets.contains("pmtiles")) << "of Terrain-RGB";
  EXPECT_FALSE(status["links"].contains("pmtiles")) << status["links"];
  EXPECT_GT(faces.size(), 3u);
  for (const Json& face : faces) EXPECT_EQ(get(face["href"]).status, 200) << face["href"];
}

TEST(Archive, IsMadeWhileNobodyWaits) {
  const std::string base = built().post("ncols 2\nnrows 2\nxllcorner 10\nyllcorner 46\ncellsize 0.1\n1 2\n3 4\n",
                                        {{"name", "small.asc"}, {"crs", "EPSG:4326"}, {"vertical-datum", "ellipsoid"}});
  const auto ask = [&](const std::string& method, const std::map<std::string, std::string>& headers,
                       const std::string& ending = ".pmtiles") {
    Request request;
    request.method = method;
    request.path = base + ending;
    request.headers = headers;
    return built().api().handle(request);
  };
  const Response first = ask("HEAD", {{"prefer", "wait=100"}});
  EXPECT_FALSE(first.later) << "a HEAD has no body to wait for";
  EXPECT_EQ(first.status, 503);
  EXPECT_NE(first.header("Retry-After"), "");
  const std::map<std::string, std::string> at_once = {{"prefer", "wait=0"}};
  EXPECT_FALSE(ask("GET", at_once).later);
  ASSERT_TRUE(eventually([&] { return ask("HEAD", at_once).status == 200; })) << "the first who asks has it made";
  const Response whole = ask("HEAD", {}), unchanged = ask("GET", {{"if-none-match", whole.header("ETag")}});
  EXPECT_EQ(unchanged.status, 304);
  EXPECT_EQ(unchanged.header("Accept-Ranges"), "bytes");
  EXPECT_EQ(whole.header("Accept-Ranges"), "bytes");
  EXPECT_EQ(ask("GET", {{"if-match", "\"nope\""}}).status, 412);
  EXPECT_EQ(ask("DELETE", {}, "").status, 204) << "its archives go with it";
}

TEST(Archive, GoesWhereRoomIsWantedAndIsMadeAgain) {
  const auto ask = [&] {
    Request request;
    request.method = "HEAD";
    request.path = built().base() + ".pmtiles";
    return built().api().handle(request).status;
  };
  ASSERT_TRUE(eventually([&] { return ask() == 200; }));
  const auto files = [&] {
    const auto folder = std::filesystem::directory_iterator(built().service().layout().archives());
    return std::distance(begin(folder), end(folder));
  };
  ASSERT_GT(files(), 0);
  EXPECT_TRUE(built().service().archive_files().spare(UINT64_MAX));
  EXPECT_EQ(files(), 0);
  EXPECT_FALSE(built().service().archive_files().spare(1)) << "there is none";
  EXPECT_EQ(ask(), 503) << "it is made";
  EXPECT_TRUE(eventually([&] { return ask() == 200; }));
}

TEST(Mesh, A304SaysOfRangesWhatThe200Says) {
  const auto ask = [](const std::map<std::string, std::string>& headers) {
    Request request;
    request.path = built().base() + "/mesh.stl";
    request.query = {{"level", "5"}};
    request.headers = headers;
    return TestService::settled(built().api().handle(request));
  };
  const Response whole = ask({}), unchanged = ask({{"if-none-match", whole.header("ETag")}});
  ASSERT_EQ(whole.status, 200) << whole.body;
  EXPECT_EQ(unchanged.status, 304);
  EXPECT_EQ(whole.header("Accept-Ranges"), "bytes");
  EXPECT_EQ(unchanged.header("Accept-Ranges"), "bytes");
}

Response asked_archive(const std::map<std::string, std::string>& headers = {}) {
  Request request;
  request.path = built().base() + ".pmtiles";
  request.headers = headers;
  Response answer = TestService::settled(built().api().handle(request));
  while (answer.next_piece) {
    const auto piece = answer.next_piece();
    if (!piece) break;
    answer.body += *piece;
  }
  return answer;
}

/// Once it is made: on a slow machine that takes longer than a request waits for it.
Response archive(const std::map<std::string, std::string>& headers = {}) {
  Response answer;
  eventually([&] {
    answer = asked_archive(headers);
    return answer.status != 503;
  });
  return answer;
}

/// Want of memory at the end of an order, on a thread whose exceptions would end the service.
TEST(KeptArchive, IsThereThoughNobodyCouldBeTold) {
  const std::string id = built().base().substr(std::string("/v1/datasets/").size());
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain) << terrain.problem().line();
  const pipeline::faces::Face* const meshes = pipeline::faces::face_named("drc");
  ASSERT_NE(meshes, nullptr);
  limits::Space space([] { return std::optional<limits::DiskSpace>(); }, 5);
  ArchiveFiles files(built().data() / "archives-of-a-test", space, [](const std::string&) { throw std::bad_alloc(); });
  for (const char* version : {"a", "b"}) {
    const ArchiveOrder order{id, version, meshes, *terrain};
    EXPECT_TRUE(eventually([&] {
      const auto found = files.find(order);
      return found.ok() && *found;
    })) << version;
  }
}

/// Want of descriptors passes, and is neither damage nor want of room.
TEST(KeptArchive, ThatWantsADescriptorIsMadeLater) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer opens a pipe when it meets an object of a type for the first time";
  const std::string id = built().base().substr(std::string("/v1/datasets/").size());
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain) << terrain.problem().line();
  limits::Space space([] { return std::optional<limits::DiskSpace>(); }, 5);
  ArchiveFiles files(built().data() / "archives-without-descriptors", space, [](const std::string&) {});
  const ArchiveOrder order{id, "a", pipeline::faces::face_named("drc"), *terrain};
  std::string problem;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  eventually([&] {
    const auto found = files.find(order, Asks::again);
    if (!found) problem = found.problem().type;
    return !found || *found;
  });
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(problem, "service-busy");
  EXPECT_TRUE(eventually([&] {
    const auto found = files.find(order);
    return found.ok() && *found;
  })) << "who asks then has it made";
  const auto written = pipeline::exports::write_export((built().data() / "export").string(), pipeline::Existing::refuse,
                                                       [](const auto&) { throw pipeline::NoDescriptor("none is left"); });
  EXPECT_EQ(written.problem().type, "service-busy") << "of the store that is read";
}

/// One problem is told to all who waited for the archive; it is not made again for each of them.
TEST(KeptArchive, ThatCannotBeMadeIsToldToAllWhoWaited) {
  const std::string id = built().base().substr(std::string("/v1/datasets/").size());
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain) << terrain.problem().line();
  std::atomic<int> made{0};
  limits::Space space([] { return std::optional(limits::DiskSpace{100, 0}); }, 5);
  ArchiveFiles files(built().data() / "archives-without-room", space, [&](const std::string&) { ++made; });
  const ArchiveOrder order{id, "a", pipeline::faces::face_named("drc"), *terrain};
  const auto asked = [&](Asks asks) {
    const auto found = files.find(order, asks);
    return found.ok() ? std::string("is made") : found.problem().type;
  };
  EXPECT_EQ(asked(Asks::first), "is made");
  ASSERT_TRUE(eventually([&] { return made == 1; }));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(asked(Asks::again), "storage-full") << k;
  EXPECT_EQ(made, 1);
  EXPECT_EQ(asked(Asks::first), "is made") << "who asks anew has it tried again";
  ASSERT_TRUE(eventually([&] { return made == 2; }));
  EXPECT_EQ(asked(Asks::first), "storage-full");
}

/// The disk is asked for room when an order begins, and again when its first bytes come.
TEST(KeptArchive, ThatIsForgottenIsMadeNoFurther) {
  const std::string id = built().base().substr(std::string("/v1/datasets/").size());
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain) << terrain.problem().line();
  std::atomic<int> asked{0}, ended{0};
  std::atomic<bool> go_on{false};
  limits::Space space(
      [&] {
        ++asked;
        EXPECT_TRUE(eventually([&] { return go_on.load(); }));
        return std::optional<limits::DiskSpace>();
      },
      5);
  ArchiveFiles files(built().data() / "forgotten-archives", space, [&](const std::string&) { ++ended; });
  const ArchiveOrder order{id, "a", pipeline::faces::face_named("drc"), *terrain};
  EXPECT_TRUE(files.find(order));
  ASSERT_TRUE(eventually([&] { return asked == 1; }));
  files.forget(id);
  EXPECT_FALSE(files.is_awaited(order));
  go_on = true;
  ASSERT_TRUE(eventually([&] { return ended == 1; }));
  EXPECT_EQ(asked, 1) << "bytes of it were written";
  EXPECT_TRUE(eventually([&] {
    const auto found = files.find(order);
    return found.ok() && *found;
  })) << "who asks then has it made";
}

std::ptrdiff_t open_descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

/// One that nobody reads takes no descriptor, and is opened when it is asked for again.
TEST(KeptArchive, IsOpenOnlyWhileItIsInUse) {
  const std::string id = built().base().substr(std::string("/v1/datasets/").size());
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain) << terrain.problem().line();
  limits::Space space([] { return std::optional<limits::DiskSpace>(); }, 5);
  const std::filesystem::path folder = built().data() / "many-archives-of-a-test";
  ArchiveFiles files(folder, space, [](const std::string&) {});
  const auto found = [&](int version) {
    const ArchiveOrder order{id, std::to_string(version), pipeline::faces::face_named("drc"), *terrain};
    std::shared_ptr<const ArchiveFile> file;
    EXPECT_TRUE(eventually([&] {
      const auto now = files.find(order);
      EXPECT_TRUE(now) << now.problem().line();
      file = now ? *now : nullptr;
      return file || !now;
    }));
    return file;
  };
  const auto first = found(0);
  const std::ptrdiff_t before = open_descriptors();
  constexpr int kMany = 60;
  for (int version = 1; version < kMany; ++version) ASSERT_TRUE(found(version)) << version;
  EXPECT_LE(open_descriptors(), before + 20);
  EXPECT_EQ(found(0)->etag(), first->etag());
  EXPECT_EQ(first->read(0, 7), "PMTiles") << "who reads it does not lose it";
  const auto kept = [&] { return std::distance(std::filesystem::directory_iterator(folder), {}); };
  EXPECT_EQ(kept(), kMany) << "none of them was made twice";
  const auto written = std::filesystem::last_write_time(folder / (id + ".1.drc.pmtiles"));
  EXPECT_EQ(found(1)->read(0, 7), "PMTiles");
  EXPECT_EQ(std::filesystem::last_write_time(folder / (id + ".1.drc.pmtiles")), written);
}

/// Whichever part is asked for, what is damaged is not served: another is made.
TEST(KeptArchive, IsNotServedDamaged) {
  const Response whole = archive();
  ASSERT_EQ(whole.status, 200) << whole.body;
  ASSERT_GT(whole.body.size(), 100'000U);
  const std::filesystem::path folder = Layout{built().data()}.archives();
  for (const std::size_t place : {std::size_t{50}, whole.body.size() - 1}) {
    const std::string part = "bytes=" + std::to_string(place - 20) + "-" + std::to_string(place);
    const Response before = archive({{"range", part}});
    EXPECT_EQ(before.status, 206);
    EXPECT_EQ(before.body, whole.body.substr(place - 20, 21));
    const std::filesystem::path file = std::filesystem::directory_iterator(folder)->path();
    std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
        .seekp(static_cast<std::streamoff>(place))
        .put(static_cast<char>(whole.body[place] ^ 4));
    EXPECT_EQ(archive({{"range", "bytes=70000-90000"}}).body, whole.body.substr(70000, 20001)) << "what is sound is served";
    const Response damaged = asked_archive({{"range", part}});
    EXPECT_EQ(damaged.status, 503) << place;
    EXPECT_EQ(slug_of(damaged), "archive-not-ready");
    const Response again = archive();
    EXPECT_EQ(again.status, 200);
    EXPECT_EQ(again.body, whole.body);
    EXPECT_EQ(again.header("ETag"), whole.header("ETag"));
  }
}

/// Who is asked for anew waits no longer in all than it wanted to.
TEST(WaitForAnArchive, DoesNotBeginAgainWhereItIsOver) {
  const std::string base = built().post("ncols 2\nnrows 2\nxllcorner 12\nyllcorner 46\ncellsize 0.1\n1 2\n3 4\n",
                                        {{"name", "brief.asc"}, {"crs", "EPSG:4326"}, {"vertical-datum", "ellipsoid"}});
  Request request;
  request.path = base + ".pmtiles";
  request.headers = {{"prefer", "wait=100"}};
  request.wait_ends = std::chrono::steady_clock::now();
  const Response waits = built().api().handle(request);
  ASSERT_TRUE(waits.later);
  EXPECT_TRUE(waits.later(Patience::more));
}

}  // namespace
}  // namespace cordillera::server
