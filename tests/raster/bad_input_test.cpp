// Files that are broken, hostile or something else: a Problem, never a crash, a hang or nonsense.
#include <ogr_srs_api.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "fixture.h"
#include "raster/gdal/proj_context.h"

namespace cordillera::raster_test {
namespace {

using raster::Trust;
using BadInput = RasterTest;

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Opens and samples everything at a level; the problem's slug or empty.
std::string outcome(const std::string& file, int level, Trust trust = Trust::posted_file) {
  auto source = open(file, plain_options(), trust);
  if (!source.ok()) return source.problem().type;
  const proto::Lattice l = lattice(level);
  const auto w = (*source)->window(l);
  auto s = (*source)->sample(l, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                             static_cast<std::int32_t>(w.north - w.south + 1));
  return s.ok() ? "" : s.problem().type;
}

/// GDAL, asked for a line behind a damaged one, looks for all before it again, and for each of these again.
TEST_F(BadInput, ATextGridWithATornLineIsToldSoAtOnce) {
  std::string grid = "ncols 200\nnrows 200\nxllcorner 10\nyllcorner 45\ncellsize 0.01\n";
  for (int row = 0; row < 100; ++row) {
    for (int column = 0; column < 200; ++column) grid += std::to_string(row + column) + " ";
    grid += "\n";
  }
  grid += std::string(90000, '7');
  auto options = plain_options();
  options.set_crs("EPSG:4326");
  const auto source = must_open(write_text(grid, "torn.asc"), options);
  ASSERT_NE(source, nullptr);
  const auto window = source->window(lattice(9));
  for (int again = 0; again < 2; ++again) {
    const auto samples = source->sample(lattice(9), window.west, window.south, 40, 4);
    ASSERT_FALSE(samples.ok());
    EXPECT_EQ(samples.problem().type, "raster-unreadable");
    EXPECT_NE(samples.problem().detail.find("row 101 of 200"), std::string::npos) << samples.problem().detail;
  }
  // What lies before the damage can be read.
  EXPECT_TRUE(source->sample(lattice(9), window.west, window.north - 20, 10, 4).ok());
}

TEST_F(BadInput, WhatIsNoRasterIsSaidToBeSo) {
  using namespace std::string_literals;
  EXPECT_EQ(problem_type(write_text("", "empty.tif")), "raster-empty");
  EXPECT_EQ(problem_type(write_text("\x89PNG\r\n\x1a\n\0\0\0\rIHDR"s, "photo.png")), "raster-format-unsupported");
  EXPECT_EQ(problem_type(write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n", "lfs.tif")),
            "raster-format-unsupported");
  EXPECT_EQ(problem_type(write_text("PK\x03\x04 zip", "dem.zip")), "archive-unreadable");
  EXPECT_EQ(problem_type(write_text("<!DOCTYPE html><html>404</html>", "dem.tif")), "raster-format-unsupported");
  EXPECT_EQ(problem_type(write_text("II*\0garbage"s, "dem.tif")), "raster-format-unsupported");
  EXPECT_EQ(problem_type(write_text("ncols 100000\nnrows 100000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3", "dem.asc")),
            "raster-truncated");
}

/// Servers send a page where a file is missing, and it is saved under the file's name.
TEST_F(BadInput, WhatAServerSaidInPlaceOfARasterIsToldSo) {
  const std::pair<const char*, const char*> pages[] = {
      {"<!DOCTYPE HTML PUBLIC \"-//IETF//DTD HTML 2.0//EN\">\n<HTML>", "dem.tif is an HTML page, not a raster"},
      {"\n<!doctype html><title>404</title>", "dem.tif is an HTML page, not a raster"},
      {"<HTML><HEAD>", "dem.tif is an HTML page, not a raster"},
      {"<?xml version=\"1.0\"?><html xmlns=\"\">", "dem.tif is an HTML page, not a raster"},
      {"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Error><Code>AccessDenied</Code></Error>",
       "dem.tif is an error of a server in XML, not a raster"},
      {"<?xml version=\"1.0\"?><ows:ExceptionReport version=\"2.0\">", "dem.tif is an error of a server in XML, not a raster"},
      {"{\"message\": \"Not Found\"}", "dem.tif is JSON, not a raster"},
      {"404: Not Found", "dem.tif is text, not a raster; it begins \"404: Not Found\""},
      {"Access denied.\r\nPlease log in.\r\n", "dem.tif is text, not a raster; it begins \"Access denied.\""}};
  for (const auto& [text, detail] : pages) {
    const auto refused = open(write_text(text, "dem.tif"));
    ASSERT_FALSE(refused.ok()) << text;
    EXPECT_EQ(refused.problem().type, "raster-format-unsupported") << text;
    EXPECT_EQ(refused.problem().detail, detail);
  }
}

TEST_F(BadInput, OfAMissingFileNoFormatIsWrong) {
  const auto missing = open(path("none.tif"));
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.problem().line(), "none.tif does not exist");
}

TEST_F(BadInput, PointsOnNoGridAreToldToBeSortedNoSecondTime) {
  const auto detail = [&](const std::string& points) {
    const auto refused = open(write_text(points, "points.xyz"));
    return refused.ok() ? std::string() : refused.problem().line();
  };
  const std::string sorted = detail("10 47 1\n10.31 46.9 2\n10.07 46.5 3\n10.9 46.2 4\n10.2 46.1 5\n10.5 46 6\n");
  EXPECT_NE(sorted.find("points.xyz is points that lie on no regular grid"), sorted.npos) << sorted;
  EXPECT_NE(sorted.find("gdal_grid makes one"), sorted.npos) << sorted;
  const std::string mixed = detail("10.5 46 6\n10 47 1\n10.31 46.9 2\n10.07 46.5 3\n10.2 46.1 5\n10.9 46.2 4\n");
  EXPECT_NE(mixed.find("sort -s -k 2,2gr -k 1,1g points.xyz > sorted.xyz"), mixed.npos) << mixed;
}

TEST_F(BadInput, ThreeBands) {
  Spec spec;
  spec.bands = 3;
  EXPECT_EQ(problem_type(write(spec)), "raster-bands");
}

TEST_F(BadInput, EveryTruncationIsRefused) {
  for (const char* compress : {"NONE", "DEFLATE", "LZW"}) {
    for (const char* tiled : {"YES", "NO"}) {
      Spec spec;
      spec.columns = spec.rows = 300, spec.type = "Int16";
      spec.create = {std::string("COMPRESS=") + compress, std::string("TILED=") + tiled};
      spec.value = [](int c, int r) { return (c * 7919 + r * 104729) % 3000; };
      const std::string good = bytes_of(write(spec));
      for (int tenth = 0; tenth < 10; ++tenth) {
        const std::string cut = write_text(good.substr(0, good.size() * static_cast<std::size_t>(tenth) / 10), "cut.tif");
        EXPECT_NE(outcome(cut, 7), "") << compress << " " << tiled << " " << tenth;
      }
      EXPECT_EQ(outcome(write_text(good, "whole.tif"), 7), "");
    }
  }
}

TEST_F(BadInput, DamagedBlocksAreFoundOnReading) {
  Spec spec;
  spec.columns = spec.rows = 300, spec.create = {"COMPRESS=DEFLATE", "TILED=YES"};
  spec.value = [](int c, int r) { return static_cast<std::uint32_t>(c * 2654435761u ^ r * 40503u) % 3001; };
  std::string bytes = bytes_of(write(spec));
  ASSERT_GT(bytes.size(), 20000u);
  for (std::size_t at = bytes.size() / 2; at < bytes.size() / 2 + 2000; ++at) bytes[at] = static_cast<char>(at * 31);
  EXPECT_EQ(outcome(write_text(bytes, "damaged.tif"), 7), "raster-unreadable");
}

TEST_F(BadInput, FlippedBytesNeverCrash) {
  Spec spec;
  spec.columns = spec.rows = 64, spec.create = {"COMPRESS=DEFLATE"};
  const std::string good = bytes_of(write(spec));
  int refused = 0;
  for (std::size_t at = 0; at < good.size(); at += 3) {
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x5a);
    refused += !outcome(write_text(bytes, "flipped.tif"), 3).empty();
  }
  EXPECT_GT(refused, 0);
}

TEST_F(BadInput, AHugeSparseRasterCostsNothing) {
  const Spec spec = huge_sparse(50000);
  const std::string file = write(spec);
  const std::clock_t start = std::clock();
  const auto source = must_open(file);
  ASSERT_TRUE(source);
  const proto::Lattice l = lattice(17);
  const auto w = source->window(l);
  std::int64_t valid = 0, sampled = 0;
  for (std::int64_t j = w.south; j <= w.north; j += 4096) {
    for (std::int64_t i = w.west; i <= w.east; i += 4096) {
      if (source->empty(l, i, j, 4096, 4096)) continue;
      for (std::int64_t jj = j; jj < j + 4096; jj += 256) {
        for (std::int64_t ii = i; ii < i + 4096; ii += 256) {
          if (source->empty(l, ii, jj, 256, 256)) continue;
          auto s = source->sample(l, ii, jj, 256, 256);
          ASSERT_TRUE(s.ok());
          ++sampled;
          for (const std::int32_t h : s->height) valid += h != proto::kNoHeight;
        }
      }
    }
  }
  EXPECT_GT(valid, 100000);
  EXPECT_LT(sampled, 200);
  EXPECT_LT(std::clock() - start, 20 * CLOCKS_PER_SEC) << "of this process, whatever else the machine does";
}

TEST_F(BadInput, TheCollection) {
  const std::string folder = real_dems() + "/bad";
  if (real_dems().empty() || !std::filesystem::is_directory(folder))
    GTEST_SKIP() << "no collection of bad files: set CORDILLERA_TEST_DATA";
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".tif") continue;
    ++files;
    for (const Trust trust : {Trust::operator_file, Trust::posted_file}) {
      const std::string type = outcome(entry.path().string(), 0, trust);
      EXPECT_EQ(type.empty(), entry.path().filename() == "geotools_1x1_neginf_nodata.tif") << entry.path() << " " << type;
    }
  }
  EXPECT_GT(files, 10);
}

/// A line of a message: no more reaches a list of datasets.
constexpr std::size_t kLine = 700;

TEST_F(BadInput, TextsOfARasterAreCut) {
  Spec spec;
  spec.unit = std::string(900000, 'u');
  const std::string file = write(spec);
  const auto refused = open(file, plain_options(), Trust::posted_file);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "unit-unknown");
  EXPECT_LT(refused.problem().line().size(), kLine);
  auto options = plain_options();
  options.set_z_scale(2);
  const auto accepted = must_open(file, options, Trust::posted_file);
  ASSERT_NE(accepted, nullptr);
  EXPECT_LT(accepted->description().unit().size(), kLine);
}

TEST_F(BadInput, TextsOfARasterStayOnTheirLine) {
  const auto is_line = [](const std::string& text) {
    return std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  };
  Spec spec;
  spec.unit = "cubits\nX-Injected: 1\r\x1b[2J";
  const std::string file = write(spec);
  const auto refused = open(file, plain_options(), Trust::posted_file);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "unit-unknown");
  EXPECT_NE(refused.problem().detail.find("cubits X-Injected: 1"), std::string::npos) << refused.problem().detail;
  EXPECT_TRUE(is_line(refused.problem().line()));
  auto options = plain_options();
  options.set_z_scale(2);
  const auto accepted = must_open(file, options, Trust::posted_file);
  ASSERT_NE(accepted, nullptr);
  EXPECT_TRUE(is_line(accepted->description().unit())) << accepted->description().unit();
  spec.unit = "";
  spec.crs = "LOCAL_CS[\"a\nb\",UNIT[\"metre\",1]]";
  const auto local = open(write(spec, "local.tif"), plain_options(), Trust::posted_file);
  ASSERT_FALSE(local.ok());
  EXPECT_EQ(local.problem().type, "crs-unsupported");
  EXPECT_TRUE(is_line(local.problem().line())) << local.problem().line();
}

TEST_F(BadInput, NamesOfACrsAreCut) {
  Spec spec;
  spec.crs = "LOCAL_CS[\"" + std::string(9000, 'n') + "\",UNIT[\"metre\",1]]";
  const auto refused = open(write(spec), plain_options(), Trust::posted_file);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "crs-unsupported");
  EXPECT_NE(refused.problem().detail.find("nnn"), std::string::npos);
  EXPECT_LT(refused.problem().line().size(), kLine);
}

TEST_F(BadInput, ARefusalTellsOfTheFileAndNotOfOurOptions) {
  const auto refused = open(write_text("ncols 99999999999\nnrows 4\nxllcorner 1\nyllcorner 1\ncellsize 1\n1 1 1 1\n", "dem.asc"),
                            plain_options(), Trust::posted_file);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail.find("GEOREF_SOURCES"), std::string::npos) << refused.problem().detail;
}

/// In a thread of its own, which opens PROJ's tables anew.
std::string problem_of_a_thread(const std::string& file, const proto::BuildOptions& options = plain_options()) {
  std::string type;
  std::thread([&] { type = problem_type(file, options, Trust::posted_file); }).join();
  return type;
}

/// GDAL, and we where we ask PROJ ourselves, look for its tables in a folder of ours while this lives.
class OtherTables {
 public:
  explicit OtherTables(const std::string& folder) {
    const char* const folders[] = {folder.c_str(), nullptr};
    OSRSetPROJSearchPaths(folders);
    setenv("CORDILLERA_GEOIDS", folder.c_str(), 1);
  }
  ~OtherTables() {
    OSRSetPROJSearchPaths(nullptr);
    unsetenv("CORDILLERA_GEOIDS");
  }
  OtherTables(const OtherTables&) = delete;
  OtherTables& operator=(const OtherTables&) = delete;
};

std::string tables_of_proj() { return bytes_of("/usr/share/proj/proj.db"); }

/// A good start, then rubbish, as from a disk that fails.
std::string with_rubbish(std::string tables, std::size_t good) {
  tables.replace(good, tables.size() - good, tables.size() - good, '\x55');
  return tables;
}

TEST_F(BadInput, TablesThatCannotBeReadAreNotTheRastersFault) {
  Spec spec;
  spec.crs = "EPSG:25832";
  spec.geotransform = {500000, 100, 0, 5000000, 0, -100};
  const std::string file = write(spec);
  EXPECT_EQ(problem_type(file, plain_options(), Trust::posted_file), "");
  const std::string tables = tables_of_proj();
  ASSERT_GT(tables.size(), 1U << 20);
  for (const std::size_t good : {std::size_t{4096}, std::size_t{65536}, tables.size() / 2}) {
    write_text(with_rubbish(tables, good), "proj.db");
    const OtherTables other(path(""));
    EXPECT_EQ(problem_of_a_thread(file), "crs-tables-unreadable") << good;
  }
  EXPECT_EQ(problem_of_a_thread(file), "");
}

/// Of these PROJ complains in other words, or aside alone.
TEST_F(BadInput, TablesThatACompoundCrsNeedsAreNotTheRastersFaultEither) {
  Spec spec;
  spec.geotransform = {500000, 100, 0, 5000000, 0, -100};
  spec.crs = "EPSG:25832+5773";
  const std::string declared = write(spec, "declared.tif");
  spec.crs = "";
  const std::string bare = write(spec, "bare.tif");
  auto asked = plain_options();
  asked.set_crs("EPSG:25832+5773");
  EXPECT_EQ(problem_of_a_thread(declared), "");
  EXPECT_EQ(problem_of_a_thread(bare, asked), "");
  const std::string tables = tables_of_proj();
  ASSERT_GT(tables.size(), 1U << 20);
  for (const char* kind : {"an empty file", "a folder", "rubbish", "half rubbish"}) {
    std::filesystem::remove_all(path("proj.db"));
    if (kind == std::string("a folder"))
      std::filesystem::create_directory(path("proj.db"));
    else
      write_text(kind == std::string("an empty file")
                     ? ""
                     : with_rubbish(tables, kind == std::string("rubbish") ? 4096 : tables.size() / 2),
                 "proj.db");
    const OtherTables other(path(""));
    EXPECT_EQ(problem_of_a_thread(declared), "crs-tables-unreadable") << kind;
    EXPECT_EQ(problem_of_a_thread(bare, asked), "crs-tables-unreadable") << kind;
  }
}

/// For these we ask PROJ ourselves. Without its answer a declared height system would be taken for the default one.
TEST_F(BadInput, TablesThatAHeightSystemNeedsAreNotTheRastersFaultEither) {
  Spec spec;
  spec.crs = "EPSG:4326";
  const std::string plain = write(spec, "plain.tif");
  spec.crs = "EPSG:4269+5703";
  const std::string declared = write(spec, "declared.tif");
  auto source_decides = plain_options();
  source_decides.clear_vertical_datum();
  auto asked = plain_options();
  asked.set_vertical_datum("EPSG:5703");
  write_text(with_rubbish(tables_of_proj(), 4096), "proj.db");
  setenv("CORDILLERA_GEOIDS", path("").c_str(), 1);  // GDAL reads its own tables, which are sound
  EXPECT_EQ(problem_of_a_thread(plain, asked), "crs-tables-unreadable");
  EXPECT_EQ(problem_of_a_thread(declared, source_decides), "crs-tables-unreadable");
  unsetenv("CORDILLERA_GEOIDS");
  EXPECT_EQ(problem_of_a_thread(plain, asked), "geoid-not-found");
}

/// In the words of a PROJ that this test does not know.
TEST_F(BadInput, WhateverProjComplainsOfAWellKnownCrsIsTried) {
  const auto failed = [] {
    bool out = false;
    std::thread([&] {
      raster::hear_proj("something else is wrong", raster::Said::as_error);
      out = raster::proj_tables_failed();
    }).join();
    return out;
  };
  EXPECT_FALSE(failed());
  write_text("", "proj.db");
  const OtherTables other(path(""));
  EXPECT_TRUE(failed());
}

TEST_F(BadInput, AFileThatSpeaksOfTablesIsRefusedAllTheSame) {
  auto options = plain_options();
  options.set_crs("EPSG:99999999");
  EXPECT_EQ(
      problem_type(
          write_text("ncols 4\nnrows 4\nxllcorner 1\nyllcorner 1\ncellsize 1\n1 1 1 1\n1 1 1 1\n1 1 1 1\n1 1 1 1\n", "dem.asc"),
          options, Trust::posted_file),
      "crs-unknown");
}

}  // namespace
}  // namespace cordillera::raster_test
