// Files that are read in pieces: the cache keeps to its size, and what is read is of one version.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "raster/storage/object_file.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster {
namespace {

constexpr std::size_t kBlock = ObjectFile::kBlock_bytes;

std::string pattern(std::size_t count, char first) {
  std::string bytes(count, '\0');
  for (std::size_t k = 0; k < count; ++k) bytes[k] = static_cast<char>(first + static_cast<char>(k % 61));
  return bytes;
}

void write(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

std::string read(ObjectFile& file, std::uint64_t offset, std::size_t count) {
  std::string bytes(count, '\0');
  const auto done = file.read(offset, count, bytes.data());
  return done.ok() ? bytes : done.problem().type;
}

class ObjectFileTest : public testing::Test {
 protected:
  ObjectFileTest() : path_((std::filesystem::temp_directory_path() / ("object-" + std::to_string(getpid()))).string()) {}
  ~ObjectFileTest() override { std::filesystem::remove(path_); }
  std::shared_ptr<ObjectFile> open(std::shared_ptr<BlockCache> cache) {
    auto file = ObjectFile::open(path_, std::move(cache));
    return file.ok() ? *file : nullptr;
  }
  std::string path_;
};

TEST(BlockCache, KeepsToItsSizeAndDropsWhatWasUsedLongestAgo) {
  BlockCache cache(300);
  const auto piece = [] { return std::make_shared<const std::string>(100, 'x'); };
  for (std::uint64_t k = 0; k < 3; ++k) cache.keep({1, k}, piece());
  EXPECT_NE(cache.find({1, 0}), nullptr);
  cache.keep({2, 0}, piece());
  EXPECT_EQ(cache.bytes(), 300u);
  EXPECT_EQ(cache.find({1, 1}), nullptr);
  EXPECT_NE(cache.find({1, 0}), nullptr);
  cache.keep({2, 1}, std::make_shared<const std::string>(301, 'y'));
  EXPECT_EQ(cache.find({2, 1}), nullptr);
  cache.forget(1);
  EXPECT_EQ(cache.bytes(), 100u);
  EXPECT_NE(cache.find({2, 0}), nullptr);
}

TEST_F(ObjectFileTest, ReadsAcrossBlocksAndToTheEnd) {
  const std::string bytes = pattern(2 * kBlock + 1234, 'A');
  write(path_, bytes);
  const auto file = open(std::make_shared<BlockCache>(2 * kBlock));
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(file->size(), bytes.size());
  EXPECT_EQ(read(*file, kBlock - 10, kBlock + 20), bytes.substr(kBlock - 10, kBlock + 20));
  EXPECT_EQ(read(*file, 2 * kBlock, 1234), bytes.substr(2 * kBlock));
}

TEST_F(ObjectFileTest, ReadsNothingOfAnotherFileThatTookItsName) {
  for (const bool renamed : {true, false}) {
    const std::string before = pattern(3 * kBlock, 'A'), after = pattern(3 * kBlock, 'B');
    write(path_, before);
    const auto file = open(std::make_shared<BlockCache>(8 * kBlock));
    ASSERT_NE(file, nullptr);
    EXPECT_EQ(read(*file, 0, 100), before.substr(0, 100));
    std::filesystem::last_write_time(path_, std::filesystem::last_write_time(path_) - std::chrono::seconds(1));
    if (renamed) {
      write(path_ + ".new", after);
      std::filesystem::rename(path_ + ".new", path_);
    } else {
      write(path_, after);
    }
    EXPECT_EQ(read(*file, kBlock, 100), "storage-changed");
    EXPECT_EQ(read(*file, 0, 100), before.substr(0, 100)) << "what is in the cache is of the old one, whole";
    EXPECT_EQ(read(*file, kBlock - 50, 100), "storage-changed");
    const auto same = file->unchanged();
    EXPECT_TRUE(same.ok() && !*same);
    const auto again = open(std::make_shared<BlockCache>(8 * kBlock));
    EXPECT_EQ(read(*again, kBlock, 100), after.substr(kBlock, 100));
  }
}

TEST_F(ObjectFileTest, SaysWhenThereIsNoFile) {
  const auto file = ObjectFile::open(path_ + "-not-there", std::make_shared<BlockCache>(kBlock));
  ASSERT_FALSE(file.ok());
  EXPECT_EQ(file.problem().type, "storage-read");
}

}  // namespace
}  // namespace cordillera::raster
