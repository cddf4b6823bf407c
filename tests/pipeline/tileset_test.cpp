#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/export.h"
#include "pipeline/faces/face.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/manifest_json.h"
#include "pipeline/tileset/subtree.h"
#include "pipeline/tileset/tileset.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;
using proto::Lattice;
using proto::TileAddress;
using namespace testing;
constexpr double kPi = std::numbers::pi;

const Lattice kLattice{7};

/// Level 7 on both sides of Greenwich; level 4 has lost its content in the west, level 0 in both halves.
class Dataset {
 public:
  Dataset() {
    auto writer = StoreWriter::open(folder_ / "a.db", synthetic_plan(7, 1));
    EXPECT_TRUE(writer.ok());
    for (FinishedTask& task : synthetic_tasks(kLattice, {7, 126, 80}, {7, 131, 85}, hills_with_voids())) {
      if (task.node.z == 0 || (task.node.z == 4 && task.node.x == 15)) task.tiles.clear();
      EXPECT_TRUE((*writer)->commit(task).ok());
    }
    EXPECT_TRUE((*writer)->publish(synthetic_manifest()).ok());
    reader_ = StoreReader::open(folder_ / "a.db").value().release();
  }
  ~Dataset() { delete reader_; }
  const StoreReader& store() const { return *reader_; }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
  const StoreReader* reader_ = nullptr;
};

const StoreReader& shared_store() {
  static const Dataset dataset;
  return dataset.store();
}

faces::Terrain shared_terrain() {
  return faces::Terrain(std::shared_ptr<const StoreReader>(std::shared_ptr<void>(), &shared_store()));
}
const std::vector<const faces::Face*> kFaces = {faces::face_named("drc"), faces::face_named("3d-tiles")};

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// A subtree file read as the specification says, apart from the code that wrote it.
struct ParsedSubtree {
  Json json;
  std::string binary;

  explicit ParsedSubtree(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 4), "subt");
    EXPECT_EQ(little_endian_at<std::uint32_t>(bytes, 4), 1U);
    const auto json_size = little_endian_at<std::uint64_t>(bytes, 8), binary_size = little_endian_at<std::uint64_t>(bytes, 16);
    EXPECT_EQ(json_size % 8 + binary_size % 8, 0U);
    EXPECT_EQ(bytes.size(), 24 + json_size + binary_size);
    json = Json::parse(bytes.substr(24, json_size));
    binary = bytes.substr(24 + json_size);
  }
  bool available(const Json& availability, std::size_t index) const {
    if (availability.contains("constant")) return availability["constant"] == 1;
    const Json& view = json["bufferViews"][availability["bitstream"].get<std::size_t>()];
    return binary[view["byteOffset"].get<std::size_t>() + index / 8] >> (index % 8) & 1;
  }
  double number(const char* property, std::size_t index) const {
    const auto view = json["propertyTables"][0]["properties"][property]["values"].get<std::size_t>();
    return std::bit_cast<double>(
        little_endian_at<std::uint64_t>(binary, json["bufferViews"][view]["byteOffset"].get<std::size_t>() + 8 * index));
  }
};

/// What a viewer finds by walking the implicit tilesets: absolute address -> has content. Checks metadata on the way.
std::map<TileAddress, bool> walk(const StoreReader& store, char hemisphere) {
  std::map<TileAddress, bool> found;
  std::vector<std::array<std::int32_t, 3>> roots = {{0, 0, 0}};
  while (!roots.empty()) {
    const auto [level, x, y] = roots.back();
    roots.pop_back();
    const auto bytes = subtree(store, hemisphere, level, x, y);
    if (!bytes) {
      ADD_FAILURE() << "a subtree that another one promised is missing";
      continue;
    }
    const ParsedSubtree file(*bytes);
    std::size_t index = 0, row = 0;
    for (int depth = 0; depth <= kSubtreeLevels; ++depth) {
      for (std::uint32_t m = 0; m < 1U << (2 * depth); ++m) {
        std::int32_t cx = x << depth, cy = y << depth;
        for (int bit = 0; bit < depth; ++bit) {
          cx += static_cast<std::int32_t>(m >> (2 * bit) & 1) << bit;
          cy += static_cast<std::int32_t>(m >> (2 * bit + 1) & 1) << bit;
        }
        if (depth == kSubtreeLevels) {
          if (file.available(file.json["childSubtreeAvailability"], m)) roots.push_back({level + depth, cx, cy});
          continue;
        }
        const std::size_t here = index++;
        if (!file.available(file.json["tileAvailability"], here)) continue;
        const TileAddress tile = *absolute_tile(hemisphere, level + depth, cx, cy);
        const bool content = file.available(file.json["contentAvailability"][0], here);
        found[tile] = content;
        if (content) {
          EXPECT_LE(file.number("region", 6 * row + 0), store.record(tile)->region(0));
          EXPECT_GE(file.number("region", 6 * row + 5), store.record(tile)->region(5));
          EXPECT_GE(file.number("geometric_error", row), store.record(tile)->max_error());
          EXPECT_LT(file.number("geometric_error", row), empty_error_m(store.manifest()));
        } else {
          EXPECT_EQ(file.number("geometric_error", row), empty_error_m(store.manifest()));
        }
        ++row;
      }
    }
    EXPECT_EQ(file.json["propertyTables"][0]["count"], row);
  }
  return found;
}

TEST(Subtree, AViewerFindsEveryTileAndNoOther) {
  const StoreReader& store = shared_store();
  std::size_t contents = 0, empty = 0;
  for (const char hemisphere : {'W', 'E'}) {
    for (const auto& [tile, content] : walk(store, hemisphere)) {
      EXPECT_EQ(hemisphere_of(tile), hemisphere);
      EXPECT_EQ(store.record(tile).has_value(), content) << tile.z << '/' << tile.x << '/' << tile.y;
      contents += content;
      empty += !content;
    }
  }
  EXPECT_EQ(contents, store.manifest().tiles());
  EXPECT_GE(empty, 3U);
}

TEST(Subtree, NoneWhereNothingIs) {
  const StoreReader& store = shared_store();
  EXPECT_FALSE(subtree(store, 'W', 5, 0, 0));
  EXPECT_FALSE(subtree(store, 'W', 1, 0, 0)) << "no subtree starts at level 1";
  EXPECT_FALSE(subtree(store, 'X', 0, 0, 0));
  EXPECT_FALSE(subtree(store, 'E', 0, 1, 0));
  EXPECT_FALSE(subtree(store, 'E', -5, 0, 0));
}

TEST(Tileset, TwoImplicitRootsUnderOne) {
  const StoreReader& store = shared_store();
  const Json json = Json::parse(tileset_json(store));
  EXPECT_EQ(json["asset"]["version"], "1.1");
  EXPECT_EQ(json["asset"]["extras"]["attribution"], "Nobody <nobody@example.org>");
  EXPECT_EQ(json["asset"]["extras"]["cesium"]["credits"][0]["html"], "Nobody &lt;nobody@example.org&gt;");
  const Json& root = json["root"];
  EXPECT_FALSE(root.contains("content"));
  ASSERT_EQ(root["children"].size(), 2U);
  EXPECT_EQ(root["children"][0]["content"]["uri"], "tiles/W/{level}/{x}/{y}.glb");
  EXPECT_EQ(root["children"][1]["implicitTiling"]["subtrees"]["uri"], "subtrees/E/{level}/{x}/{y}.subtree");
  EXPECT_EQ(root["children"][1]["implicitTiling"]["availableLevels"], 8);
  EXPECT_GE(root["geometricError"], root["children"][0]["geometricError"]);
  // Clients quarter an implicit root's region to find a subtree; the root above says where the data is.
  const std::array<std::array<double, 4>, 2> hemispheres{{{-kPi, -kPi / 2, 0, kPi / 2}, {0, -kPi / 2, kPi, kPi / 2}}};
  for (std::size_t side = 0; side < 2; ++side) {
    const auto region = root["children"][side]["boundingVolume"]["region"].get<std::array<double, 6>>();
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(region[i], hemispheres[side][i], 1e-13) << side << ' ' << i;
  }
  EXPECT_GT(root["boundingVolume"]["region"][1], -kPi / 2);
}

/// The northern and the eastern end of the last of 2^level parts, the way they are found by adding.
TEST(Tileset, PartsOfARegionNeverEndBeyondThePoleOrTheAntimeridian) {
  Json roots = Json::parse(tileset_json(shared_store()))["root"]["children"];
  const auto surface = faces::find("terrain3d/tileset.json")->resource->make(shared_terrain(), {}).value();
  const Json of_surface = Json::parse(surface->bytes);
  for (const Json& root : of_surface["root"]["children"]) roots.push_back(root);
  EXPECT_EQ(roots.size(), 4U);
  for (const Json& child : roots) {
    const auto [west, south, east, north, low, high] = child["boundingVolume"]["region"].get<std::array<double, 6>>();
    for (int level = 0; level <= 21; ++level) {
      const double parts = std::ldexp(1, level), width = (east - west) / parts, height = (north - south) / parts;
      EXPECT_LE(west + width * (parts - 1) + width, kPi) << level;
      EXPECT_LE(south + height * (parts - 1) + height, kPi / 2) << level;
      EXPECT_LE(south + height * parts, kPi / 2) << level;
    }
    double middle = south;
    for (int level = 0; level <= 21; ++level) middle += (north - middle) * 0.5;
    EXPECT_LE(middle + (north - middle), kPi / 2);
    EXPECT_LT(low, high);
  }
}

TEST(Tileset, OnlyTheHemisphereThatHasData) {
  const TemporaryFolder folder;
  auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(7));
  ASSERT_TRUE(writer.ok());
  FinishedTask task;
  task.node = {7, 200, 80};
  task.tiles.push_back(*synthetic_tile(kLattice, task.node, hills()));
  ASSERT_TRUE((*writer)->commit(task).ok());
  ASSERT_TRUE((*writer)->publish(synthetic_manifest()).ok());
  const auto store = StoreReader::open(folder / "a.db");
  ASSERT_TRUE(store.ok());
  const Json json = Json::parse(tileset_json(**store));
  ASSERT_EQ(json["root"]["children"].size(), 1U);
  EXPECT_EQ(json["root"]["children"][0]["content"]["uri"], "tiles/E/{level}/{x}/{y}.glb");
  EXPECT_FALSE(subtree(**store, 'W', 0, 0, 0));
}

// A few tiles on both sides of 180 degrees: as a region their root would be the whole circle of latitude.
TEST(Tileset, TheRootOfDataOverTheAntimeridianIsASphere) {
  const TemporaryFolder folder;
  auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(7));
  ASSERT_TRUE(writer.ok());
  for (const std::int32_t x : {0, 1, 254, 255}) {
    FinishedTask task;
    task.node = {7, x, 80};
    task.tiles.push_back(*synthetic_tile(kLattice, task.node, hills()));
    ASSERT_TRUE((*writer)->commit(task).ok());
  }
  const auto published = (*writer)->publish(synthetic_manifest());
  ASSERT_TRUE(published.ok());
  ASSERT_GT(published->bounds(0), published->bounds(2));
  std::shared_ptr<const StoreReader> store = StoreReader::open(folder / "a.db").value();
  const Json volume = Json::parse(tileset_json(*store))["root"]["boundingVolume"];
  ASSERT_TRUE(volume.contains("sphere")) << volume;
  EXPECT_FALSE(volume.contains("region"));
  const auto sphere = volume["sphere"].get<std::array<double, 4>>();
  EXPECT_LT(sphere[3], 700e3);
  const proto::Vec3 centre{sphere[0], sphere[1], sphere[2]};
  double farthest = 0;
  for (const std::int64_t tile : {0, 1, 254, 255}) {
    for (const auto& [x, y] : {std::pair{0, 0}, {256, 0}, {0, 256}, {256, 256}, {128, 128}}) {
      const proto::Vec3 at =
          proto::ecef(proto::row_frame(kLattice, 80 * 256 + y), proto::column_frame(kLattice, tile * 256 + x), 0);
      farthest = std::max(farthest, proto::length(at - centre));
    }
  }
  EXPECT_LT(farthest, sphere[3]);
  EXPECT_GT(farthest, 0.8 * sphere[3]);
  const auto explicit_one = faces::find("tileset-explicit.json");
  const faces::Terrain terrain(store);
  EXPECT_EQ(Json::parse(explicit_one->resource->make(terrain, explicit_one->place).value()->bytes)["root"]["boundingVolume"],
            volume);
}

TEST(TilesetPaths, OneNameATileAFace) {
  const auto drc = faces::find("tiles/7/129/80.drc"), east = faces::find("tiles/E/7/1/80.glb");
  ASSERT_TRUE(drc && east);
  EXPECT_EQ(drc->place.x, 129);
  EXPECT_EQ(east->place.root, 'E');
  EXPECT_EQ(faces::path_of(*drc->resource, drc->place), "tiles/7/129/80.drc");
  EXPECT_EQ(faces::path_of(*east->resource, east->place), "tiles/E/7/1/80.glb");
  for (const char* bad :
       {"", "tiles/7/129/80", "tiles/7/129/80.png", "tiles/07/129/80.drc", "tiles/7/-1/80.drc", "tiles/7/1/2/3.drc",
        "tiles/7//2.drc", "tiles/7/1/2 .drc", "tiles/w/7/1/80.glb", "tiles/7/99999999999/1.drc", "../tiles/7/1/80.drc",
        "subtrees/5/31/20.subtree", "subtrees/W/5/31/20.glb", "subtrees/W/5/31.subtree", "tileset.json/"}) {
    EXPECT_FALSE(faces::find(bad)) << bad;
  }
  for (const char* beyond : {"tiles/7/256/80.drc", "tiles/7/1/128.drc", "tiles/99/0/0.drc", "tiles/E/7/128/80.glb"}) {
    const auto found = faces::find(beyond);
    ASSERT_TRUE(found) << beyond;
    EXPECT_FALSE(faces::inside(found->resource->grid, found->place)) << beyond;
  }
}

/// Every file of a folder but manifest.json, by its path.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).generic_string()] = read_file(entry.path());
  }
  files.erase("manifest.json");
  EXPECT_EQ(files.erase("index.html"), files.contains("tileset.json") ? 1u : 0u);
  return files;
}

TEST(TilesetExport, PathsAreTheServicesAndTilesDecode) {
  const TemporaryFolder folder;
  const StoreReader& store = shared_store();
  const faces::Terrain terrain = shared_terrain();
  const fs::path out = folder / "out";
  ASSERT_TRUE(export_static(terrain, kFaces, out.string() + "/", Existing::replace, 3).ok());
  EXPECT_EQ(read_file(out / "tileset.json"), tileset_json(store));
  EXPECT_EQ(read_file(out / "manifest.json"), manifest_json(store.manifest()));
  std::size_t drc = 0, glb = 0, subtrees = 0;
  for (const auto& [path, bytes] : files_of(out)) {
    const auto found = faces::find(path);
    ASSERT_TRUE(found) << path;
    EXPECT_EQ(bytes, (*found->resource->make(terrain, found->place))->bytes) << path;
    drc += path.ends_with(".drc") ? 1 : 0;
    glb += path.ends_with(".glb") ? 1 : 0;
    subtrees += path.ends_with(".subtree") ? 1 : 0;
  }
  EXPECT_EQ(drc, store.manifest().tiles());
  EXPECT_EQ(glb, store.manifest().tiles());
  EXPECT_EQ(subtrees, 6U);
  EXPECT_TRUE(decode_glb(read_file(out / "tiles/E/7/1/80.glb")).ok());
}

TEST(TilesetExport, RemovesWhatAKilledOneLeft) {
  const TemporaryFolder folder;
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  const std::string of_gone = std::to_string(gone), of_other = "1";
  const std::vector<std::string> kept = {"out.partial-" + of_other,  "out.partial-" + of_gone + ".old",
                                         "out.partial-0" + of_gone,  "out.partial-",
                                         "other.partial-" + of_gone, "out.partial-x"};
  for (const std::string& name : kept) fs::create_directories(folder / name);
  fs::create_directories(folder / ("out.partial-" + of_gone + "/tiles"));
  ASSERT_TRUE(export_static(shared_terrain(), kFaces, folder / "out").ok());
  EXPECT_FALSE(fs::exists(folder / ("out.partial-" + of_gone)));
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(folder / name)) << name;
  // With nothing in its place the earlier export was all that a kill had left.
  ASSERT_TRUE(export_static(shared_terrain(), kFaces, folder / "out").ok());
  for (const std::string& name : kept) EXPECT_EQ(fs::exists(folder / name), !name.ends_with(".old")) << name;
}

TEST(TilesetExport, ReplacesAnEarlierExportAndNothingElse) {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  fs::create_directories(out);
  ASSERT_TRUE(export_static(shared_terrain(), kFaces, out).ok()) << "an empty folder is fine";
  fs::remove(out / "tileset.json");
  ASSERT_TRUE(export_static(shared_terrain(), kFaces, out).ok()) << "an earlier export is replaced";
  EXPECT_TRUE(fs::exists(out / "tileset.json"));
  std::ofstream(out / "thesis.doc") << "the only copy";
  EXPECT_EQ(export_static(shared_terrain(), kFaces, out).problem().type, "export-folder-in-use");
  EXPECT_TRUE(fs::exists(out / "thesis.doc"));
  std::ofstream(folder / "file") << "x";
  EXPECT_FALSE(export_static(shared_terrain(), kFaces, folder / "file").ok());
  std::size_t entries = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder / ".")) ++entries;
  EXPECT_EQ(entries, 2U) << "something temporary was left";
}

}  // namespace
}  // namespace cordillera::pipeline
