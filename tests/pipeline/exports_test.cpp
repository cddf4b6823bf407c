// Archives of tiles, read back by their specifications and compared with what the faces make.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>

#include "pipeline/encode/json.h"
#include "pipeline/exports/archive_3tz.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/hilbert.h"
#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/mesh/mesh_extract.h"
#include "pipeline/exports/pmtiles.h"
#include "pipeline/exports/pmtiles_directory.h"
#include "pipeline/exports/tile_places.h"
#include "pipeline/exports/unpack_tiles.h"
#include "pipeline/store/content_hash.h"
#include "tests/pipeline/archive_readers.h"
#include "tests/pipeline/archived_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using namespace pipeline::testing;
using faces::Face;
using faces::Grid;

/// One in so many is made once more and compared; that a tile is there is seen of all.
constexpr std::size_t kDrawnAgain = 3;

TEST(Hilbert, NumbersAreThoseOfTheSpecification) {
  EXPECT_EQ(hilbert_id({0, 0, 0}), 0u);
  EXPECT_EQ(hilbert_id({1, 0, 0}), 1u);
  EXPECT_EQ(hilbert_id({1, 0, 1}), 2u);
  EXPECT_EQ(hilbert_id({1, 1, 1}), 3u);
  EXPECT_EQ(hilbert_id({1, 1, 0}), 4u);
  EXPECT_EQ(hilbert_id({2, 0, 0}), 5u);
  EXPECT_EQ(hilbert_id({12, 3423, 1763}), 19078479u);
}

TEST(Hilbert, ConsecutiveTilesTouchAndAddressesComeBack) {
  for (std::uint64_t id = 5; id < 21845; ++id) {
    const SquareAddress here = hilbert_address(id), next = hilbert_address(id + 1);
    ASSERT_EQ(hilbert_id(here), id);
    if (here.zoom != next.zoom) continue;
    const int step = std::abs(int(here.x) - int(next.x)) + std::abs(int(here.y) - int(next.y));
    ASSERT_EQ(step, 1) << id;
  }
  const SquareAddress far{22, 4194303, 2097152};
  EXPECT_EQ(hilbert_address(hilbert_id(far)), far);
}

TEST(SquareAddresses, TheGeodeticGridIsTheNorthOfASquareOneZoomDown) {
  EXPECT_EQ(square_address(Grid::geodetic, {0, 0, 1, 0}), (SquareAddress{1, 1, 0}));
  EXPECT_EQ(square_address(Grid::geodetic, {0, 3, 9, 0}), (SquareAddress{4, 9, 7}));
  EXPECT_EQ(square_address(Grid::web_mercator, {0, 3, 5, 2}), (SquareAddress{3, 5, 2}));
  EXPECT_EQ(square_address(Grid::web_mercator_south, {0, 3, 5, 2}), (SquareAddress{3, 5, 5}));
  EXPECT_EQ(place_at(Grid::web_mercator_south, {3, 5, 5}).y, 2);
  const faces::Place back = place_at(Grid::geodetic, {4, 9, 7});
  EXPECT_EQ(std::tie(back.z, back.x, back.y), std::make_tuple(3, 9, 0));
}

/// Every face with tiles: the archive holds what the face names, byte for byte, and nothing else.
TEST(Pmtiles, HoldsEveryTileOfEveryFace) {
  int archives = 0;
  for (const Face* face : faces::all_faces()) {
    if (!fits_pmtiles(*face)) continue;
    const std::string file = archived_dataset().place(std::string(face->name) + ".pmtiles");
    const auto written = write_pmtiles(archived_dataset().terrain(), *face, file);
    ASSERT_TRUE(written.ok()) << face->name << ": " << written.problem().line();
    const PmtilesReader reader(bytes_of(file));
    const faces::Resource& tiles = *tiles_of(*face);
    std::set<std::uint64_t> wanted;
    each_place(archived_dataset().terrain(), *face, tiles, 2, [&](const faces::Place& at) {
      const std::uint64_t id = hilbert_id(square_address(tiles.grid, at));
      const std::string path = faces::path_of(tiles, at);
      const auto found = reader.tile(id);
      ASSERT_TRUE(found) << path;
      if (wanted.size() % kDrawnAgain == 0) {
        EXPECT_EQ(reader.byte(98) == 2 ? gunzipped(*found) : *found, face_bytes(path)) << path;
      }
      wanted.insert(id);
    });
    EXPECT_GE(wanted.size(), 10u) << face->name;
    EXPECT_EQ(reader.at64(72), wanted.size()) << face->name;
    EXPECT_EQ(reader.at64(80), reader.runs().size());
    EXPECT_EQ(reader.byte(100), hilbert_address(*wanted.begin()).zoom);
    EXPECT_EQ(reader.byte(101), hilbert_address(*wanted.rbegin()).zoom);
    ++archives;
  }
  EXPECT_GE(archives, 2);
}

TEST(Pmtiles, IsClusteredAndSaysWhatItIs) {
  const std::string file = archived_dataset().place("said.pmtiles");
  ASSERT_TRUE(write_pmtiles(archived_dataset().terrain(), *faces::face_named("drc"), file).ok());
  const PmtilesReader reader(bytes_of(file));
  EXPECT_EQ(reader.byte(96), 1);
  EXPECT_GT(reader.byte(118), reader.byte(100)) << "a client that begins at the archive's own zoom sees more than a dot";
  std::uint64_t end = 0;
  std::set<std::uint64_t> offsets;
  for (const DirectoryRun& run : reader.runs()) {
    EXPECT_LE(run.offset, end) << "a gap or a step ahead";
    end = std::max(end, run.offset + run.length);
    offsets.insert(run.offset);
  }
  EXPECT_EQ(end, reader.at64(64));
  EXPECT_EQ(offsets.size(), reader.at64(88));
  const auto& bounds = archived_dataset().terrain().manifest().bounds();
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(reader.degrees(102 + 4 * static_cast<std::size_t>(k)), bounds[k], 1e-6);
  const Json metadata = Json::parse(reader.metadata());
  EXPECT_EQ(metadata["attribution"], "Nobody &lt;nobody@example.org&gt;");
  EXPECT_EQ(metadata["name"], "Synthetic hills");
  EXPECT_EQ(metadata["tile_matrix_set"], "GoogleCRS84Quad");
  EXPECT_EQ(metadata["manifest"]["max_level"], 7);
}

TEST(Pmtiles, OfContoursAreVectorTilesWithTheirLayers) {
  const std::string file = archived_dataset().place("lines.pmtiles");
  ASSERT_TRUE(write_pmtiles(archived_dataset().terrain(), *faces::face_named("contours"), file).ok());
  const PmtilesReader reader(bytes_of(file));
  EXPECT_EQ(reader.byte(98), 2) << "gzip";
  EXPECT_EQ(reader.byte(99), 1) << "MVT";
  const Json metadata = Json::parse(reader.metadata());
  EXPECT_EQ(metadata["vector_layers"][0]["id"], "contours");
  EXPECT_EQ(metadata["vector_layers"][0]["minzoom"], reader.byte(100)) << "as the header has it";
  EXPECT_EQ(metadata["vector_layers"][0]["maxzoom"], reader.byte(101));
  // Where zoom 0 has no line, the archive begins at another one than the TileJSON.
  const Json later = vector_layers(archived_dataset().terrain(), *faces::face_named("contours"), 2, 3);
  EXPECT_EQ(later[0]["minzoom"], 2);
  EXPECT_EQ(later[0]["maxzoom"], 3);
  EXPECT_EQ(metadata["format"], "pbf");
}

TEST(Pmtiles, EqualTilesAreOneRun) {
  std::vector<PmtilesEntry> entries;
  append(entries, {10, 0, 5, 1});
  append(entries, {11, 0, 5, 1});
  append(entries, {13, 0, 5, 1});
  append(entries, {14, 5, 5, 1});
  ASSERT_EQ(entries.size(), 3u);
  EXPECT_EQ(entries[0].run, 2u);
}

TEST(Pmtiles, ALargeDirectoryHasLeavesAndASmallRoot) {
  std::vector<PmtilesEntry> entries;
  std::uint64_t offset = 0;
  for (std::uint64_t k = 0; k < 120000; ++k) {
    const auto length = static_cast<std::uint32_t>(content_hash(std::to_string(k))[0] & 127) + 1000;
    entries.push_back({3 * k + 7, offset, length, 1});
    offset += length;
  }
  const PmtilesDirectories made = pmtiles_directories(entries);
  EXPECT_LE(made.root.size(), kMostRootBytes);
  std::string file = "PMTiles\3" + std::string(kPmtilesHeader - 8, '\0');
  const auto put = [&](std::size_t at, std::uint64_t value) { std::memcpy(file.data() + at, &value, 8); };
  put(8, kPmtilesHeader);
  put(16, made.root.size());
  put(40, kPmtilesHeader + made.root.size());
  const PmtilesReader reader(file + made.root + made.leaves);
  EXPECT_GT(reader.leaves(), 10);
  ASSERT_EQ(reader.runs().size(), entries.size());
  for (std::size_t k = 0; k < entries.size(); k += 997) {
    EXPECT_EQ(reader.runs()[k].id, entries[k].id);
    EXPECT_EQ(reader.runs()[k].offset, entries[k].offset);
    EXPECT_EQ(reader.runs()[k].length, entries[k].length);
  }
}

TEST(Mbtiles, HoldsThePicturesWithRowsFromTheSouth) {
  int archives = 0;
  for (const Face* face : faces::all_faces()) {
    if (!fits_mbtiles(*face)) continue;
    const std::string file = archived_dataset().place(std::string(face->name) + ".mbtiles");
    const auto written = write_mbtiles(archived_dataset().terrain(), *face, file);
    ASSERT_TRUE(written.ok()) << face->name << ": " << written.problem().line();
    const faces::Resource& tiles = *tiles_of(*face);
    const bool vectors = face->name == "contours";
    std::size_t count = 0;
    for (const auto& row : sqlite_rows(file, "SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles")) {
      const int z = std::stoi(row[0]);
      const faces::Place at{0, z, std::stoi(row[1]), (1 << z) - 1 - std::stoi(row[2])};
      if (count % kDrawnAgain == 0) {
        EXPECT_EQ(vectors ? gunzipped(row[3]) : row[3], face_bytes(faces::path_of(tiles, at))) << faces::path_of(tiles, at);
      }
      ++count;
    }
    EXPECT_EQ(count, paths_of(*face).size() - 1) << "every path but the TileJSON is a tile";
    EXPECT_EQ(sqlite_rows(file, "SELECT count(*) = count(DISTINCT tile_data) FROM images")[0][0], "1");
    std::map<std::string, std::string> said;
    for (const auto& row : sqlite_rows(file, "SELECT name, value FROM metadata")) said[row[0]] = row[1];
    EXPECT_EQ(said["name"], "Synthetic hills");
    EXPECT_EQ(said["attribution"], "Nobody &lt;nobody@example.org&gt;");
    EXPECT_EQ(said["format"], vectors ? "pbf" : tiles.path.substr(tiles.path.rfind('.') + 1));
    EXPECT_EQ(said["type"], vectors ? "overlay" : "baselayer");
    EXPECT_EQ(said.contains("json"), vectors);
    if (vectors) {
      const Json layer = Json::parse(said["json"])["vector_layers"][0];
      EXPECT_EQ(layer["id"], "contours");
      EXPECT_EQ(layer["minzoom"].dump(), said["minzoom"]);
      EXPECT_EQ(layer["maxzoom"].dump(), said["maxzoom"]);
    }
    EXPECT_EQ(said["maxzoom"], sqlite_rows(file, "SELECT max(zoom_level) FROM map")[0][0]);
    const int look_from = std::stoi(said["center"].substr(said["center"].rfind(',') + 1));
    EXPECT_GE(look_from, std::stoi(said["minzoom"]));
    EXPECT_LE(look_from, std::stoi(said["maxzoom"]));
    EXPECT_EQ(std::count(said["bounds"].begin(), said["bounds"].end(), ','), 3);
    ++archives;
  }
  EXPECT_EQ(archives == 0, faces::face_named("terrain-rgb") == nullptr);
}

/// The folder is as `build` writes one of that format: its tiles, TileJSON and manifest.
void expect_tiles_of(const Face& face, const std::string& folder) {
  for (const std::string& path : paths_of(face)) {
    if (path == face.entry) continue;
    EXPECT_EQ(bytes_of(folder + "/" + path), face_bytes(path)) << path;
  }
  const Json said = Json::parse(bytes_of(folder + "/" + std::string(face.entry)));
  const Json own = Json::parse(face_bytes(std::string(face.entry)));
  for (const char* name : {"tiles", "minzoom", "maxzoom", "encoding", "vector_layers"})
    EXPECT_EQ(said.value(name, Json()), own.value(name, Json())) << name;
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(said["bounds"][k].get<double>(), own["bounds"][k].get<double>(), 1e-5);
  const Json manifest = Json::parse(bytes_of(folder + "/manifest.json"));
  const std::string title = manifest.value("title", "");  // an MBTiles file has one name
  EXPECT_EQ(title.empty() ? manifest.value("name", "") : title, archived_dataset().terrain().manifest().title());
}

std::string problem_of(const std::string& archive) {
  TemporaryFolder folder;
  const auto done = unpack_tiles(archive, folder / ".");
  return done.ok() ? "" : done.problem().type;
}

TEST(TileArchives, ComeBackAsTheFolderThatBuildWrites) {
  for (const char* name : {"terrarium", "contours"}) {
    const Face& face = *faces::face_named(name);
    const auto& terrain = archived_dataset().terrain();
    const std::string pmtiles = archived_dataset().place("back.pmtiles"), mbtiles = archived_dataset().place("back.mbtiles");
    ASSERT_TRUE(write_pmtiles(terrain, face, pmtiles).ok() && write_mbtiles(terrain, face, mbtiles, Existing::replace).ok());
    for (const std::string& archive : {pmtiles, mbtiles}) {
      ASSERT_TRUE(is_tile_archive(archive)) << archive;
      TemporaryFolder folder;
      const auto done = unpack_tiles(archive, folder / ".");
      ASSERT_TRUE(done.ok()) << name << ": " << done.problem().line();
      expect_tiles_of(face, folder / ".");
    }
  }
  EXPECT_FALSE(is_tile_archive(archived_dataset().place("a.db")));
}

/// What other programs write: no word of an encoding, no mark of MBTiles, no manifest.
TEST(TileArchives, OfOthersAreTakenForHeightsWhereTheyCanBeNoPicture) {
  for (const char* name : {"terrain-rgb", "relief"}) {
    const std::string file = archived_dataset().place(std::string("others-") + name + ".mbtiles");
    ASSERT_TRUE(write_mbtiles(archived_dataset().terrain(), *faces::face_named(name), file, Existing::replace).ok());
    sqlite_rows(file, "DELETE FROM metadata WHERE name <> 'name'");
    sqlite_rows(file, "PRAGMA application_id = 0");
    ASSERT_TRUE(is_tile_archive(file));
    TemporaryFolder folder;
    ASSERT_TRUE(unpack_tiles(file, folder / ".").ok());
    const Json said = Json::parse(bytes_of(folder / (std::string(name) + ".json")));
    EXPECT_EQ(said.value("encoding", ""), name == std::string("relief") ? "" : "mapbox");
    // The box of the tiles holds that of the data.
    const auto& bounds = archived_dataset().terrain().manifest().bounds();
    EXPECT_LE(said["bounds"][0], bounds[0] + 1e-6);
    EXPECT_GE(said["bounds"][3], bounds[3] - 1e-6);
  }
}

TEST(TileArchives, ThatCannotBeShownAreRefusedWithTheReason) {
  const auto& terrain = archived_dataset().terrain();
  const std::string meshes = archived_dataset().place("meshes.pmtiles"), whole = archived_dataset().place("sound.pmtiles");
  ASSERT_TRUE(write_pmtiles(terrain, *faces::face_named("drc"), meshes).ok());
  EXPECT_EQ(problem_of(meshes), "file-unreadable");
  ASSERT_TRUE(write_pmtiles(terrain, *faces::face_named("terrain-rgb"), whole).ok());
  const auto sound = describe_archive(whole);
  ASSERT_TRUE(sound.ok());
  std::map<int, std::uint64_t> tiles;
  const Face& of = *faces::face_named("terrain-rgb");
  each_place(terrain, of, *tiles_of(of), 1, [&](const faces::Place& at) { ++tiles[at.z]; });
  EXPECT_EQ(sound->tiles, tiles);
  EXPECT_EQ(sound->face, "terrain-rgb");
  const std::string bytes = bytes_of(whole), damaged = archived_dataset().place("damaged.pmtiles");
  for (const std::size_t size : {std::size_t{7}, std::size_t{100}, std::size_t{200}, bytes.size() - 1}) {
    std::ofstream(damaged, std::ios::binary) << bytes.substr(0, size);
    EXPECT_EQ(problem_of(damaged), "archive-unreadable") << size;
  }
  // Whatever is wrong with header and directories, reading ends with what was found or a problem.
  for (std::size_t at = 8; at < 400; at += 13) {
    std::string other = bytes;
    other[at] = static_cast<char>(other[at] ^ 0x5a);
    std::ofstream(damaged, std::ios::binary) << other;
    const auto described = describe_archive(damaged);
    EXPECT_TRUE(described.ok() || described.problem().type.starts_with("archive-")) << at;
    const std::string problem = problem_of(damaged);
    EXPECT_TRUE(problem.empty() || problem == "archive-unreadable" || problem == "archive-too-large" ||
                problem == "file-unreadable")
        << at << problem;
  }
  const std::string no_tables = archived_dataset().place("empty.mbtiles");
  sqlite_rows(no_tables, "CREATE TABLE something(other)");
  EXPECT_EQ(problem_of(no_tables), "archive-unreadable");
}

TEST(Archives, AppearWholeOrNotAtAll) {
  const Face& face = *faces::face_named("drc");
  const std::string file = archived_dataset().place("whole.pmtiles");
  ASSERT_TRUE(write_pmtiles(archived_dataset().terrain(), face, file, Existing::refuse).ok());
  const std::string before = bytes_of(file);
  const auto again = write_pmtiles(archived_dataset().terrain(), face, file, Existing::refuse);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.problem().type, "output-exists");
  ASSERT_TRUE(write_pmtiles(archived_dataset().terrain(), face, file, Existing::replace).ok());
  EXPECT_EQ(bytes_of(file), before);
  const auto nowhere = write_pmtiles(archived_dataset().terrain(), face, archived_dataset().place("no/folder.pmtiles"));
  ASSERT_FALSE(nowhere.ok());
  EXPECT_EQ(nowhere.problem().type, "output-failed");
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(file).parent_path())) {
    EXPECT_EQ(entry.path().filename().string().find("partial"), std::string::npos) << entry.path();
  }
}

TEST(Archives, WhatKilledProcessesLeftBesideThemGoes) {
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  ASSERT_EQ(waitpid(gone, nullptr, 0), gone);
  TemporaryFolder folder;
  const std::string of_gone = ".a.pmtiles." + std::to_string(gone) + ".partial";
  const std::vector<std::string> left = {of_gone, of_gone + ".tiles"};
  const std::vector<std::string> kept = {".a.pmtiles." + std::to_string(getppid()) + ".partial", ".b" + of_gone,
                                         of_gone + ".mine", ".a.pmtiles..partial"};
  for (const auto* names : {&left, &kept}) {
    for (const std::string& name : *names) std::ofstream(folder / name) << "x";
  }
  const std::string file = folder / "a.pmtiles";
  ASSERT_TRUE(write_pmtiles(archived_dataset().terrain(), *faces::face_named("drc"), file).ok());
  for (const std::string& name : left) EXPECT_FALSE(std::filesystem::exists(folder / name)) << name;
  for (const std::string& name : kept) EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
}

TEST(Archives, ThatAreStoppedLeaveTheEarlierOneAndNothingElse) {
  auto store = StoreReader::open(archived_dataset().place("a.db"));
  ASSERT_TRUE(store.ok());
  const std::atomic<bool> stop{true};
  const faces::Terrain stopped(std::move(*store), {}, &stop);
  TemporaryFolder folder;
  const auto expect_stopped = [&](const std::string& name, const auto& write) {
    const std::string file = folder / name;
    std::ofstream(file) << "earlier";
    const proto::Result<void> written = write(file);
    ASSERT_FALSE(written.ok()) << name;
    EXPECT_EQ(written.problem().type, "cancelled") << name;
    EXPECT_EQ(bytes_of(file), "earlier");
    std::filesystem::remove(file);
  };
  expect_stopped("a.pmtiles", [&](const std::string& file) {
    return write_pmtiles(stopped, *faces::face_named("terrarium"), file, Existing::replace);
  });
  expect_stopped("a.mbtiles", [&](const std::string& file) {
    return write_mbtiles(stopped, *faces::face_named("terrarium"), file, Existing::replace);
  });
  expect_stopped("a.3tz", [&](const std::string& file) {
    return write_3tz(stopped, *faces::face_named("3d-tiles"), file, Existing::replace);
  });
  MeshRequest whole;
  const auto mesh = extract_mesh(stopped, whole);
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.problem().type, "cancelled");
  EXPECT_TRUE(std::filesystem::is_empty(folder / "."));
}

TEST(Archives, ThreadsDoNotShow) {
  const auto expect_same = [](const std::string& name, auto write, const char* face) {
    std::vector<std::string> files;
    for (const unsigned threads : {1u, 3u}) {
      const std::string file = archived_dataset().place(std::to_string(threads) + name);
      EXPECT_TRUE(write(archived_dataset().terrain(), *faces::face_named(face), file, Existing::replace, threads).ok()) << name;
      files.push_back(bytes_of(file));
    }
    EXPECT_EQ(files[0], files[1]) << name;
    EXPECT_GT(files[0].size(), 1000u);
  };
  const auto pmtiles = [](const faces::Terrain& terrain, const Face& face, const std::string& file, Existing other,
                          unsigned threads) { return write_pmtiles(terrain, face, file, other, threads); };
  expect_same("hills.pmtiles", pmtiles, "drc");
  expect_same("lines.pmtiles", pmtiles, "contours");
  expect_same("hills.3tz", write_3tz, "3d-tiles");
  expect_same("hills.mbtiles", write_mbtiles, "terrain-rgb");
}

}  // namespace
}  // namespace cordillera::pipeline::exports
