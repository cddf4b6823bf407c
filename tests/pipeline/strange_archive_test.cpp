// Archives of tiles that are small, and would be much.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/encode/json.h"
#include "pipeline/exports/hilbert.h"
#include "pipeline/exports/pmtiles_directory.h"
#include "pipeline/exports/unpack_tiles.h"
#include "pipeline/store/sqlite.h"
#include "raster/disk/free_space.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;
using testing::bytes_of;
using testing::TemporaryFolder;

constexpr std::size_t kMiB = std::size_t{1} << 20;

std::string varint(std::uint64_t value) {
  std::string out;
  for (; value > 127; value >>= 7) out += static_cast<char>(value | 128);
  return out += static_cast<char>(value);
}

/// With nothing compressed.
std::string directory(const std::vector<PmtilesEntry>& entries) {
  std::string out = varint(entries.size());
  std::uint64_t before = 0;
  for (const PmtilesEntry& entry : entries) out += varint(entry.id - std::exchange(before, entry.id));
  for (const PmtilesEntry& entry : entries) out += varint(entry.run);
  for (const PmtilesEntry& entry : entries) out += varint(entry.length);
  for (const PmtilesEntry& entry : entries) out += varint(entry.offset + 1);
  return out;
}

struct Parts {
  std::string root, metadata, leaves, tiles;
};

std::string put_pmtiles(const std::string& path, const Parts& parts) {
  std::string header = std::string("PMTiles\3") + std::string(119, '\0');
  const auto put = [&](std::size_t at, std::uint64_t value) {
    for (std::size_t k = 0; k < 8; ++k) header[at + k] = static_cast<char>(value >> (8 * k));
  };
  std::uint64_t offset = header.size();
  std::size_t at = 8;
  for (const std::string* part : {&parts.root, &parts.metadata, &parts.leaves, &parts.tiles}) {
    put(at, std::exchange(offset, offset + part->size()));
    put(at + 8, part->size());
    at += 16;
  }
  header[97] = header[98] = 1;  // not compressed
  header[99] = 2;               // PNG
  std::ofstream(path, std::ios::binary) << header << parts.root << parts.metadata << parts.leaves << parts.tiles;
  return path;
}

struct Unpacked {
  std::string problem, detail;  ///< empty: none
  std::size_t files = 0;
};

Unpacked unpacked(const std::string& archive, const std::string& folder, const std::atomic<bool>* stop = nullptr) {
  const auto done = unpack_tiles(archive, folder, stop);
  Unpacked out{done.ok() ? "" : done.problem().type, done.ok() ? "" : done.problem().detail};
  for (const auto& entry : fs::recursive_directory_iterator(folder)) out.files += entry.is_regular_file() ? 1 : 0;
  return out;
}

TEST(StrangeArchive, ARunOfEqualTilesIsWrittenOnce) {
  const TemporaryFolder folder, out;
  // All of zoom 4, and one tile more of other bytes.
  const std::string other = "another";
  const std::string archive = put_pmtiles(folder / "a.pmtiles", {directory({{hilbert_id({4, 0, 0}), 0, kMiB, 200},
                                                                            {hilbert_id({4, 0, 0}) + 200, 0, kMiB, 55},
                                                                            {hilbert_id({4, 0, 0}) + 255, kMiB, 7, 1}}),
                                                                 "", "", std::string(kMiB, 'x') + other});
  const Unpacked done = unpacked(archive, out / ".");
  EXPECT_EQ(done.problem, "") << done.detail;
  EXPECT_EQ(done.files, 256u + 2u) << "with TileJSON and manifest";
  std::size_t once = 0;
  for (const auto& entry : fs::recursive_directory_iterator(out / "relief")) {
    if (!entry.is_regular_file()) continue;
    if (entry.file_size() == kMiB)
      EXPECT_EQ(fs::hard_link_count(entry.path()), 255u) << entry.path();
    else
      once += bytes_of(entry.path().string()) == other ? 1 : 0;
  }
  EXPECT_EQ(once, 1u);
}

TEST(StrangeArchive, IsRefusedBeforeTheDiskIsFull) {
  const TemporaryFolder folder, out;
  std::vector<PmtilesEntry> tiles;  // each a little further on in the same two megabytes
  for (std::uint64_t k = 0; k < 200; ++k) tiles.push_back({hilbert_id({4, 0, 0}) + k, k, kMiB, 1});
  const std::string archive = put_pmtiles(folder / "a.pmtiles", {directory(tiles), "", "", std::string(2 * kMiB, 'x')});
  raster::keep_free(fs::space(out / ".").available - 100 * kMiB);
  const Unpacked done = unpacked(archive, out / ".");
  raster::keep_free(0);
  EXPECT_EQ(done.problem, "storage-full");
  EXPECT_NE(done.detail.find("a.pmtiles unpacks to, 200 MiB: the disk has "), std::string::npos) << done.detail;
  EXPECT_EQ(done.files, 0u);

  const std::string many = put_pmtiles(folder / "b.pmtiles", {directory({{hilbert_id({12, 0, 0}), 0, 1, 1000001}}), "", "", "x"});
  const Unpacked too_many = unpacked(many, out / ".");
  EXPECT_EQ(too_many.problem, "archive-too-large");
  EXPECT_EQ(too_many.files, 0u);
}

/// 150 leaves, each of which names another 150 times: those are 22,500.
TEST(StrangeArchive, ItsDirectoriesAreCountedAsOftenAsTheyAreNamed) {
  const TemporaryFolder folder, out;
  const std::string none = directory({});
  const auto naming = [](std::uint64_t offset, std::size_t length) {
    std::vector<PmtilesEntry> leaves;
    for (std::uint64_t k = 0; k < 150; ++k) leaves.push_back({k, offset, static_cast<std::uint32_t>(length), 0});
    return directory(leaves);
  };
  const std::string middle = naming(0, none.size());
  const std::string archive = put_pmtiles(folder / "a.pmtiles", {naming(none.size(), middle.size()), "", none + middle, ""});
  const Unpacked done = unpacked(archive, out / ".");
  EXPECT_EQ(done.problem, "archive-unreadable");
  EXPECT_NE(done.detail.find("more than 20,000"), std::string::npos) << done.detail;
}

TEST(StrangeArchive, ItsMetadataIsReadWithinBounds) {
  const auto name_with = [](int members) {
    const TemporaryFolder folder, out;
    std::string metadata = R"({"name":"Alps")";
    for (int k = 0; k < members; ++k) metadata += ",\"" + std::to_string(k) + "\":1";
    const std::string archive = put_pmtiles(folder / "a.pmtiles", {directory({{0, 0, 1, 1}}), metadata + "}", "", "x"});
    EXPECT_EQ(unpacked(archive, out / ".").problem, "");
    return Json::parse(bytes_of(out / "relief.json")).value("name", "none");
  };
  EXPECT_EQ(name_with(9000), "Alps");
  EXPECT_EQ(name_with(11000), "");
}

TEST(StrangeArchive, MbtilesMayHaveViewsAndEndWhenTheyAreStopped) {
  const TemporaryFolder folder;
  const auto archive = [&](const std::string& name, const std::string& tiles, const std::string& metadata) {
    const std::string path = folder / name;
    Database(path, Database::Mode::create).execute("CREATE VIEW metadata AS " + metadata + "; CREATE VIEW tiles AS " + tiles);
    return path;
  };
  const std::string one = "SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row, ",
                    named = "SELECT 'name' AS name, 'a' AS value";
  const auto problem_of = [&](const std::string& path, bool stopped) {
    const TemporaryFolder out;
    const std::atomic<bool> stop{stopped};
    return unpacked(path, out / ".", &stop).problem;
  };
  const std::string sound = archive("a.mbtiles", one + "x'00' AS tile_data", named);
  EXPECT_EQ(problem_of(sound, false), "");
  EXPECT_EQ(problem_of(sound, true), "cancelled");
  EXPECT_EQ(problem_of(archive("b.mbtiles", one + "zeroblob(1000000000) AS tile_data", named), false), "archive-unreadable");
  const std::string endless = "WITH RECURSIVE r(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM r) ";
  EXPECT_EQ(problem_of(archive("c.mbtiles", endless + one + "'' AS tile_data FROM r WHERE n < 0", named), true), "cancelled");
  EXPECT_EQ(problem_of(archive("d.mbtiles", one + "x'00' AS tile_data", endless + "SELECT n AS name, n AS value FROM r"), false),
            "archive-unreadable");
}

}  // namespace
}  // namespace cordillera::pipeline::exports
