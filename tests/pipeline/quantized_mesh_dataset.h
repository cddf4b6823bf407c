#pragma once
// The dataset that the faces with a whole surface are tested on.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::testing {

inline constexpr int kFinest = 7;
inline const proto::Lattice kLattice{kFinest};

/// Level 7 on both sides of Greenwich, lakes without data in it; levels 0 and 1 are not published.
struct SurfaceDataset {
  TemporaryFolder folder;
  std::shared_ptr<const StoreReader> store;
  std::unique_ptr<faces::Terrain> terrain;

  SurfaceDataset() {
    auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(kFinest, 2));
    EXPECT_TRUE(writer.ok());
    for (FinishedTask& task : synthetic_tasks(kLattice, {kFinest, 126, 80}, {kFinest, 131, 85}, hills_with_voids())) {
      if (task.node.z < 2) task.tiles.clear();
      EXPECT_TRUE((*writer)->commit(task).ok());
    }
    EXPECT_TRUE((*writer)->publish(synthetic_manifest()).ok());
    store = StoreReader::open(folder / "a.db").value();
    terrain = std::make_unique<faces::Terrain>(store);
  }
};

inline std::optional<faces::Document> fetch(const faces::Terrain& of, const std::string& path) {
  const auto found = faces::find(path);
  EXPECT_TRUE(found) << path;
  return found->resource->make(of, found->place).value();
}

/// The tiles that a layer.json lists.
inline std::set<proto::TileAddress> listed_in(const Json& layer) {
  std::set<proto::TileAddress> listed;
  for (int z = 0; const Json& level : layer["available"]) {
    for (const Json& r : level) {
      for (std::int32_t y = r["startY"]; y <= r["endY"].get<int>(); ++y)
        for (std::int32_t x = r["startX"]; x <= r["endX"].get<int>(); ++x) listed.insert({z, x, y});
    }
    ++z;
  }
  return listed;
}

/// A dataset of some tiles; change: of each of them, before it is written.
struct SomeTiles {
  TemporaryFolder folder;
  std::unique_ptr<faces::Terrain> terrain;

  SomeTiles(const proto::TileAddress& first, const proto::TileAddress& last, const Heights& heights,
            const std::function<void(proto::TileRecord& record)>& change = nullptr) {
    auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(kFinest));
    EXPECT_TRUE(writer.ok());
    for (FinishedTask& task : synthetic_tasks(kLattice, first, last, heights)) {
      for (EncodedTile& tile : task.tiles) {
        if (change) change(tile.record);
      }
      EXPECT_TRUE((*writer)->commit(task).ok());
    }
    EXPECT_TRUE((*writer)->publish(synthetic_manifest()).ok());
    terrain = std::make_unique<faces::Terrain>(std::shared_ptr<const StoreReader>(StoreReader::open(folder / "a.db").value()));
  }
  std::optional<faces::Document> fetch(const std::string& path) const { return testing::fetch(*terrain, path); }
};

inline const faces::Terrain& terrain() {
  static const SurfaceDataset dataset;
  return *dataset.terrain;
}

inline std::optional<faces::Document> fetch(const std::string& path) { return fetch(terrain(), path); }

}  // namespace cordillera::pipeline::testing
