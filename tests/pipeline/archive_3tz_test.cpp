// 3TZ and the ZIP below it, read back by their specifications and by Python; and what unpacking leaves of a disk.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>

#include "pipeline/exports/archive_3tz.h"
#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/unpack_tiles.h"
#include "pipeline/exports/zip_writer.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/tileset/manifest_json.h"
#include "raster/disk/free_space.h"
#include "tests/pipeline/archive_readers.h"
#include "tests/pipeline/archived_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using namespace pipeline::testing;

TEST(Archive3tz, HoldsEveryPathAndAnIndexThatFindsIt) {
  const Face& face = *faces::face_named("3d-tiles");
  ASSERT_TRUE(fits_3tz(face));
  EXPECT_FALSE(fits_3tz(*faces::face_named("drc")));
  const std::string file = archived_dataset().place("a.3tz");
  ASSERT_TRUE(write_3tz(archived_dataset().terrain(), face, file).ok());
  const auto entries = zip_entries(bytes_of(file));
  ASSERT_EQ(entries.size(), paths_of(face).size() + 2);
  ASSERT_EQ(entries.back().name, "@3dtilesIndex1@");
  const std::string& index = entries.back().bytes;
  ASSERT_EQ(index.size(), 24 * (entries.size() - 1));
  std::map<std::string, std::uint64_t> offsets;
  std::array<std::uint64_t, 2> last{};
  for (std::size_t at = 0; at < index.size(); at += 24) {
    const std::array<std::uint64_t, 2> hash{number_at<std::uint64_t>(index, at), number_at<std::uint64_t>(index, at + 8)};
    EXPECT_TRUE(at == 0 || last < hash);
    last = hash;
    offsets[index.substr(at, 16)] = number_at<std::uint64_t>(index, at + 16);
  }
  bool tileset = false;
  for (std::size_t k = 0; k + 1 < entries.size(); ++k) {
    const bool manifest = entries[k].name == "manifest.json";
    EXPECT_EQ(entries[k].bytes, manifest ? manifest_json(archived_dataset().terrain().manifest()) : face_bytes(entries[k].name))
        << entries[k].name;
    EXPECT_EQ(offsets.at(md5(entries[k].name)), entries[k].local) << entries[k].name;
    tileset = tileset || entries[k].name == "tileset.json";
  }
  EXPECT_TRUE(tileset);
  EXPECT_EQ(hex(md5("tileset.json")), "c09bdea7e745894f499a7517db9a7709");
}

/// More entries than ZIP's own two bytes count: another reader finds them all.
TEST(ZipWriter, SeventyThousandEntriesAreReadByPython) {
  if (std::system("python3 -c 'import zipfile' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
  const std::string file = archived_dataset().place("many.zip");
  {
    std::ofstream out(file, std::ios::binary);
    ZipWriter zip(out);
    for (int k = 0; k < 70000; ++k) zip.add("tiles/" + std::to_string(k), std::to_string(k));
    zip.finish();
  }
  const std::string script =
      "import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); n = z.namelist(); "
      "sys.exit(len(n) != 70000 or any(z.read(f'tiles/{k}') != str(k).encode() for k in (0, 65534, 65535, 65536, 69999)))";
  EXPECT_EQ(std::system(("python3 -c \"" + script + "\" " + file).c_str()), 0);
}

/// Holes in place of what is written in pieces of a MiB and more, which are zeros here.
class SparseFile : public std::streambuf {
 public:
  explicit SparseFile(const std::string& path) : file_(::open(path.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600)) {}
  ~SparseFile() override { ::close(file_); }

 protected:
  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    if (count >= 1 << 20) return ::lseek(file_, count, SEEK_CUR) < 0 ? 0 : count;
    return ::write(file_, bytes, static_cast<std::size_t>(count));
  }

 private:
  int file_;
};

/// Another reader finds what lies beyond the four bytes that ZIP's own places have, and checks the sum of what lies before it.
TEST(ZipWriter, AnArchiveBeyondFourGibIsReadByPython) {
  if (std::getenv("CORDILLERA_ALL_TESTS") == nullptr) GTEST_SKIP() << "seconds, for the sums of 4 GiB: in the long run";
  if (std::system("python3 -c 'import zipfile' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is not installed";
  const std::string file = archived_dataset().place("large.zip");
  {
    SparseFile holes(file);
    std::ostream out(&holes);
    ZipWriter zip(out);
    const std::string zeros(64 << 20, '\0');
    for (int k = 0; k < 64; ++k) zip.add("zeros/" + std::to_string(k), zeros);
    EXPECT_GT(zip.add("last", "here"), std::uint64_t{1} << 32);
    zip.finish();
    ASSERT_TRUE(out.good());
  }
  const std::string script =
      "import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); "
      "sys.exit(len(z.namelist()) != 65 or z.getinfo('last').header_offset <= 1 << 32 or z.read('last') != b'here' or "
      "any(z.read('zeros/63')))";
  EXPECT_EQ(std::system(("python3 -c \"" + script + "\" " + file).c_str()), 0);
}

/// A small file may hold much: here a view that computes 128 tiles of a MiB.
TEST(TileArchives, LeaveTheDiskItsRoom) {
  const std::string file = archived_dataset().place("much.mbtiles");
  ASSERT_TRUE(write_mbtiles(archived_dataset().terrain(), *faces::face_named("relief"), file, Existing::replace).ok());
  Database(file, Database::Mode::create)
      .execute(
          "DROP VIEW IF EXISTS tiles; DROP TABLE IF EXISTS tiles; CREATE VIEW tiles AS WITH RECURSIVE c(n) AS (SELECT 0 UNION "
          "ALL SELECT n + 1 FROM c WHERE n < 127) SELECT 8 AS zoom_level, n AS tile_column, 9 AS tile_row, zeroblob(1048576) AS "
          "tile_data FROM c");
  TemporaryFolder folder;
  EXPECT_TRUE(unpack_tiles(file, folder / ".").ok());
  TemporaryFolder full;
  raster::keep_free(std::filesystem::space(full / ".").available - (std::uint64_t{32} << 20));
  const auto done = unpack_tiles(file, full / ".");
  raster::keep_free(0);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.problem().type, "storage-full");
}

}  // namespace
}  // namespace cordillera::pipeline::exports
