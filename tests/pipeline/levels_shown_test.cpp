// Levels that show little of the data, or nothing: what is noted of them, and what documents say to their clients.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/faces/tilejson.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/levels_shown.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/manifest_json.h"
#include "pipeline/tileset/tileset.h"
#include "tests/pipeline/quantized_mesh_dataset.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

/// By level: the part of 1000 cells that its tiles show together; none: its records do not say. 0: it has no tiles.
using Shares = std::map<int, std::optional<double>>;

/// Levels that are not named show all.
struct Shown {
  TemporaryFolder folder;
  proto::Manifest manifest;
  std::unique_ptr<faces::Terrain> terrain;

  explicit Shown(const Shares& shares, const proto::Manifest& blank = synthetic_manifest()) {
    const proto::TileAddress first{kFinest, 126, 80}, last{kFinest, 131, 85};
    auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(kFinest));
    EXPECT_TRUE(writer.ok());
    auto tasks = synthetic_tasks(kLattice, first, last, hills_with_voids());
    std::map<int, double> count;
    for (const FinishedTask& task : tasks) count[task.node.z] += static_cast<double>(task.tiles.size());
    for (FinishedTask& task : tasks) {
      const auto named = shares.find(task.node.z);
      const std::optional<double> share = named == shares.end() ? 1 : named->second;
      if (share == 0) task.tiles.clear();
      for (EncodedTile& tile : task.tiles) {
        if (share) tile.record.set_shown(1000 * *share / count[task.node.z]);
      }
      EXPECT_TRUE((*writer)->commit(task).ok());
    }
    manifest = (*writer)->publish(blank).value();
    terrain = std::make_unique<faces::Terrain>(std::shared_ptr<const StoreReader>(StoreReader::open(folder / "a.db").value()));
  }
  std::vector<std::string> notes() const { return {manifest.notes().begin(), manifest.notes().end()}; }
  Json fetched(const std::string& path) const { return Json::parse(fetch(*terrain, path)->bytes); }
};

using Notes = std::vector<std::string>;
Notes notes_of(const Shares& shares) { return Shown(shares).notes(); }
const std::string kWhy = ": it lies in strips or spots narrower than two cells there, where rims may move by one";

TEST(LevelsShown, ThoseThatShowLessThanHalfAreNoted) {
  EXPECT_EQ(notes_of({}), Notes{});
  EXPECT_EQ(notes_of({{0, 0.51}, {1, 0.6}}), Notes{});
  EXPECT_EQ(notes_of({{0, 0.49}}), Notes{"level 0 shows less than half of the data" + kWhy});
  EXPECT_EQ(notes_of({{0, 0}}), Notes{"level 0 shows hardly any of the data" + kWhy});
  EXPECT_EQ(notes_of({{0, 0}, {1, 0}, {2, 0.1}, {3, 0.4}, {4, 0.7}}),
            Notes{"levels 0 to 3 show less than half of the data, and levels 0 to 1 hardly any" + kWhy});
  EXPECT_EQ(notes_of({{2, 0.1}}), Notes{}) << "seen from afar it is there";
}

TEST(LevelsShown, NothingIsSaidThatNobodyKnows) {
  proto::Manifest blank = synthetic_manifest();
  blank.set_provisional(true);
  const Shown old({{7, std::nullopt}, {1, 0.1}, {0, 0.1}}), partly({{2, std::nullopt}, {1, 0.1}, {0, 0.1}}),
      provisional({{0, 0.1}}, blank);
  EXPECT_EQ(old.notes(), Notes{});
  EXPECT_FALSE(old.manifest.levels(7).has_shown_share());
  EXPECT_EQ(partly.notes(), Notes{"levels 0 to 1 show less than half of the data" + kWhy});
  EXPECT_FALSE(partly.manifest.levels(5).has_shown_share());
  EXPECT_NEAR(partly.manifest.levels(6).shown_share(), 0.1, 1e-9);
  EXPECT_EQ(provisional.notes(), Notes{});
}

double error_of(const Json& tile) { return tile["geometricError"]; }

/// Geometric errors of the explicit tileset by level.
void gather(const Shown& from, const Json& tile, int level, std::map<int, std::vector<double>>& errors) {
  const std::string content = tile.contains("content") ? tile["content"]["uri"].get<std::string>() : "";
  if (content.ends_with(".json"))
    return gather(from, from.fetched(content.substr(content.find("explicit/")))["root"], level, errors);
  errors[level].push_back(error_of(tile));
  if (!tile.contains("children")) return;
  for (const Json& child : tile["children"]) gather(from, child, level + 1, errors);
}

TEST(LevelsShown, ViewersLookBelowThoseThatShowLittle) {
  const Shown sparse({{0, 0}, {1, 0}, {2, 0}, {3, 0.2}, {4, 0.3}});
  const double empty_m = empty_error_m(sparse.manifest);
  const RefineErrors errors(sparse.manifest);
  for (int z = 0; z <= kFinest; ++z) {
    for (const TileExtent& node : sparse.terrain->store().extents(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      if (z <= 4) {
        EXPECT_EQ(errors.of(node), empty_m) << z;
      } else if (node.content) {
        EXPECT_EQ(errors.of(node), node.geometric_error_m) << z;
      }
    }
  }
  std::map<int, std::vector<double>> by_level;
  const Json explicit_one = sparse.fetched("tileset-explicit.json"), implicit_one = sparse.fetched("tileset.json");
  for (const Json& root : explicit_one["root"]["children"]) gather(sparse, root, 0, by_level);
  for (int z = 0; z <= 4; ++z) EXPECT_EQ(std::ranges::min(by_level.at(z)), empty_m) << z;
  for (int z = 5; z <= kFinest; ++z) EXPECT_LT(std::ranges::min(by_level.at(z)), empty_m) << z;
  for (const Json& root : implicit_one["root"]["children"]) EXPECT_EQ(error_of(root), empty_m);
}

TEST(LevelsShown, ALevelWithoutTilesHasNoErrorAndNoHeights) {
  const Shown sparse({{0, 0}, {1, 0}});
  const Json layer = sparse.fetched("layer.json");
  for (const Json& level : layer["cordillera"]["levels"])
    EXPECT_EQ(level.contains("stated_max_error"), level["level"] >= 2) << level;
  const Json levels = Json::parse(manifest_json(sparse.manifest))["levels"];
  for (const Json& level : levels) {
    for (const char* name : {"stated_max_error", "min_height", "max_height"})
      EXPECT_EQ(level[name].is_null(), level["level"] < 2) << name << level;
  }
  const auto extent = faces::extent_of(sparse.manifest);
  ASSERT_TRUE(extent);
  const faces::Zooms zooms = faces::zooms_of(sparse.manifest, *extent);
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    const Json entry = faces::zoom_entry(sparse.manifest, *extent, zooms, zoom);
    EXPECT_EQ(entry["stated_max_error"].is_null(), entry["levels"].back() < 2) << entry;
  }
  EXPECT_TRUE(faces::zoom_entry(sparse.manifest, *extent, zooms, zooms.first)["stated_max_error"].is_null());
  const auto again = parse_manifest_json(manifest_json(sparse.manifest));
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->SerializeAsString(), sparse.manifest.SerializeAsString());
}

}  // namespace
}  // namespace cordillera::pipeline
