// Which datasets are held open, and what is remembered of the others.
#include "server/datasets/library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"

namespace cordillera::server {
namespace {

std::string named(int k) {
  std::string name = "d";
  return name += std::to_string(k);
}

/// Descriptors of this process on files of the folder.
std::size_t descriptors_in(const std::filesystem::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string file = std::filesystem::read_symlink(entry.path(), error).string();
    if (file.rfind(folder.string(), 0) == 0) ++count;
  }
  return count;
}

struct Shelf {
  explicit Shelf(std::size_t most_kept_bytes, int datasets) : library(layout, metrics, mounts, {.kept_bytes = most_kept_bytes}) {
    std::filesystem::create_directories(layout.dataset("d0"));
    make_store(layout.store("d0").string(), "d0");
    for (int k = 1; k < datasets; ++k) std::filesystem::copy(layout.dataset("d0"), layout.dataset(named(k)));
  }
  TempFolder folder;
  Layout layout{folder.path()};
  metrics::ServiceMetrics metrics;
  Settings settings;
  Mounts mounts{settings};
  Library library;
};

TEST(Library, AListOpensNoDataset) {
  TestService test;
  for (int k = 0; k < 3; ++k) ASSERT_EQ(test.post("GOOD", {}, {{"prefer", "wait=60"}}).status, 201);
  const auto opens = [&] {
    const std::string text = test.get("/metrics").body;
    const auto at = text.find("cordillera_store_opens_total{result=\"miss\"}");
    return at == text.npos ? std::string("none") : text.substr(at, text.find('\n', at) - at);
  };
  const std::string before = opens();
  const Json list = body_of(test.get("/v1/datasets"))["datasets"];
  ASSERT_EQ(list.size(), 3u);
  for (const Json& dataset : list) {
    EXPECT_EQ(dataset["manifest"]["attribution"], "Somebody");
    EXPECT_EQ(dataset["version"], body_of(test.get("/v1/datasets/" + std::string(dataset["id"])))["version"]);
  }
  EXPECT_EQ(opens(), before);
}

TEST(Library, WhatIsDeletedWhileItIsAskedForIsNotDamaged) {
  Shelf shelf(1 << 20, 2);
  shelf.library.set_existence_check([](const std::string& id) { return id == "d0"; });
  for (const char* id : {"d0", "d1"}) std::filesystem::remove(shelf.layout.store(id));
  EXPECT_EQ(shelf.library.open("d1").problem().type, "dataset-unknown");
  EXPECT_EQ(shelf.library.summary("d1").problem().type, "dataset-unknown");
  EXPECT_EQ(shelf.library.damaged_count(), 0u);
  EXPECT_EQ(shelf.library.open("d0").problem().type, "store-damaged") << "nobody deleted it";
  EXPECT_EQ(shelf.library.damaged_count(), 1u);

  TestService test;
  const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=60"}}))["id"];
  ASSERT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
  EXPECT_EQ(test.service().library().open(id).problem().type, "dataset-unknown")
      << "as a request does that found the dataset a moment before";
}

TEST(Library, WhatIsDeletedIsForgotten) {
  Shelf shelf(1 << 20, 1);
  ASSERT_TRUE(shelf.library.open("d0"));
  ASSERT_TRUE(shelf.library.summary("d0"));
  std::filesystem::remove_all(shelf.layout.dataset("d0"));
  EXPECT_TRUE(shelf.library.open("d0")) << "kept open";
  shelf.library.forget("d0");
  EXPECT_FALSE(shelf.library.open("d0"));
  EXPECT_FALSE(shelf.library.summary("d0"));
  EXPECT_EQ(descriptors_in(shelf.folder.path()), 0u) << "its room on the disk is not given back";
}

TEST(Library, DescriptorsHaveABound) {
  Shelf shelf(1 << 20, 200);
  for (int k = 0; k < 200; ++k) ASSERT_TRUE(shelf.library.open(named(k)));
  EXPECT_LE(descriptors_in(shelf.folder.path()), 64 * 4u);
}

TEST(Library, MemoryOfAllFacesHasABound) {
  Shelf shelf(4 << 20, 40);
  std::size_t open = 0, most = 0;
  std::vector<std::weak_ptr<const pipeline::faces::Terrain>> all;
  for (int k = 0; k < 40; ++k) {
    const auto terrain = shelf.library.open(named(k));
    ASSERT_TRUE(terrain);
    ASSERT_TRUE((*terrain)->kept("made", []() -> proto::Result<std::optional<pipeline::faces::Document>> {
      return std::optional(pipeline::faces::Document{std::string(1 << 20, 'x'), ""});
    }));
    all.push_back(*terrain);
    open = static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](const auto& one) { return !one.expired(); }));
    most = std::max(most, open);
  }
  EXPECT_LE(most, 5u) << "three and the two that are open as well";
  EXPECT_GE(open, 3u) << "nothing is kept";
}

}  // namespace
}  // namespace cordillera::server
