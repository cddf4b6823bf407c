// A store keeps the .drc alone: its .glb is made when it is asked for, always with the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/tile_glb.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;
using namespace testing;

constexpr int kFinest = 5;
const proto::Lattice kLattice{kFinest};

proto::Plan plan_with_steps() {
  proto::Plan plan = synthetic_plan(kFinest);
  for (proto::LevelPlan& level : *plan.mutable_levels()) {
    level.set_ecef_step(smallest_ecef_step_m(static_cast<int>(level.level())));
    level.set_chain_tolerance(20);
    level.set_height_step(proto::kHeightStep_m);
  }
  plan.mutable_options()->set_title("Hills");
  return plan;
}

class OneEncoding : public ::testing::Test {
 protected:
  void SetUp() override { write(path_, false); }

  void write(const std::string& path, bool both) {
    auto store = StoreWriter::open(path, plan_with_steps());
    ASSERT_TRUE(store.ok());
    for (FinishedTask task : work_) {
      for (EncodedTile& tile : task.tiles) {
        if (!both) tile.glb.clear();
      }
      ASSERT_TRUE((*store)->commit(task).ok());
    }
    ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
  }

  static std::unique_ptr<StoreReader> reader(const std::string& path) {
    auto opened = StoreReader::open(path);
    EXPECT_TRUE(opened.ok()) << opened.problem().line();
    return std::move(opened).value();
  }
  void change(const std::string& sql) { Database(path_, Database::Mode::create).execute(sql); }
  template <class Read>
  static bool refuses(const Read& read) {
    try {
      (void)read();
      return false;
    } catch (const StoreError&) { return true; }
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "a.sqlite";
  const std::vector<FinishedTask> work_ = synthetic_tasks(kLattice, {kFinest, 31, 20}, {kFinest, 33, 21}, hills_with_voids());
};

std::vector<std::array<double, 3>> sorted(const std::vector<proto::Vec3>& points) {
  std::vector<std::array<double, 3>> out;
  for (const proto::Vec3& p : points) out.push_back({p.x, p.y, p.z});
  std::sort(out.begin(), out.end());
  return out;
}

/// What the .drc says, by its formula, on the level's grid of ECEF steps.
std::vector<proto::Vec3> corners(const DecodedDrc& drc, const TileAddress& tile, double step) {
  std::vector<proto::Vec3> out;
  for (const auto& [u, v, h] : drc.points) {
    const proto::Vec3 p = proto::ecef(proto::row_frame(kLattice, kLattice.south(tile) + v),
                                      proto::column_frame(kLattice, kLattice.west(tile) + u), h * drc.height_step);
    out.push_back({std::nearbyint(p.x / step) * step, std::nearbyint(p.y / step) * step, std::nearbyint(p.z / step) * step});
  }
  return out;
}

/// What a .glb shows of it: no triangle with two corners at a pole, which are lines in space, nor what they alone have as
/// corners.
DecodedDrc shown_in_space(DecodedDrc drc, const TileAddress& tile) {
  const auto at_pole = [&](std::uint32_t k) {
    const auto row = kLattice.south(tile) + drc.points[k][1];
    return row == 0 || row == kLattice.rows();
  };
  std::erase_if(drc.triangles, [&](const auto& t) { return at_pole(t[0]) + at_pole(t[1]) + at_pole(t[2]) > 1; });
  std::set<std::uint32_t> used;
  for (const auto& t : drc.triangles) used.insert(t.begin(), t.end());
  auto points = std::move(drc.points);
  drc.points.clear();
  for (const std::uint32_t k : used) drc.points.push_back(points[k]);
  return drc;
}

TEST_F(OneEncoding, GlbHasTheCornersOfItsDrc) {
  const auto store = reader(path_);
  std::size_t seen = 0;
  for (const FinishedTask& task : work_) {
    if (task.tiles.empty()) continue;
    const auto drc = decode_drc(store->tile(task.node, Encoding::drc)->bytes);
    const auto glb = decode_glb(store->tile(task.node, Encoding::glb)->bytes);
    ASSERT_TRUE(drc.ok() && glb.ok());
    const DecodedDrc shown = shown_in_space(*drc, task.node);
    EXPECT_EQ(sorted(glb->points), sorted(corners(shown, task.node, smallest_ecef_step_m(task.node.z))));
    EXPECT_EQ(glb->triangles.size(), shown.triangles.size());
    EXPECT_FALSE(glb->skirt_points.empty());
    ++seen;
  }
  EXPECT_GT(seen, 5U);
}

TEST_F(OneEncoding, NothingElseIsStored) {
  Database database(path_, Database::Mode::published);
  EXPECT_EQ(database.integer("SELECT count(*) FROM blobs"), database.integer("SELECT count(DISTINCT drc) FROM tiles"));
  EXPECT_EQ(database.integer("PRAGMA user_version"), 2);
  const auto store = reader(path_);
  EXPECT_EQ(store->manifest().bytes(), static_cast<double>(database.integer("SELECT sum(length(bytes)) FROM blobs")));
}

TEST_F(OneEncoding, TagsAreContentHashesAndNeverChange) {
  const auto store = reader(path_), again = reader(path_);
  const faces::Terrain terrain(reader(path_));
  for (const FinishedTask& task : work_) {
    if (task.tiles.empty()) continue;
    const auto blob = store->tile(task.node, Encoding::glb);
    EXPECT_EQ(blob->etag, hex(content_hash(blob->bytes)));
    EXPECT_EQ(again->tag(task.node, Encoding::glb), blob->etag) << "asked for before its bytes";
    EXPECT_EQ(again->tile(task.node, Encoding::glb)->bytes, blob->bytes);
    EXPECT_EQ(terrain.tile_tag(task.node, Encoding::glb), blob->etag);
    EXPECT_EQ(terrain.tile(task.node, Encoding::glb)->bytes, blob->bytes);
  }
  EXPECT_FALSE(store->tile({kFinest, 0, 0}, Encoding::glb));
  EXPECT_FALSE(store->tag({kFinest, 0, 0}, Encoding::glb));
}

TEST_F(OneEncoding, DamagedBytesMakeNoGlb) {
  const TileAddress tile = work_[0].node;
  change("UPDATE blobs SET bytes = CAST('x' || bytes AS BLOB)");
  const auto store = reader(path_);
  EXPECT_TRUE(refuses([&] { return store->tile(tile, Encoding::glb); }));
  EXPECT_TRUE(refuses([&] { return store->tag(tile, Encoding::glb); }));
}

TEST_F(OneEncoding, DamagedPlanMakesNoGlb) {
  const TileAddress tile = work_[0].node;
  change("UPDATE meta SET value = CAST(value || 'x' AS BLOB) WHERE key = 'plan'");
  const auto store = reader(path_);
  EXPECT_TRUE(refuses([&] { return store->tile(tile, Encoding::glb); }));
  EXPECT_TRUE(store->tile(tile, Encoding::drc)) << "it needs no plan";
}

TEST_F(OneEncoding, AnothersDrcMakesNoGlb) {
  const EncodedTile &one = work_[0].tiles[0], &other = work_[1].tiles[0];
  EXPECT_TRUE(tile_glb(plan_with_steps(), one.record, one.drc).ok());
  EXPECT_EQ(tile_glb(plan_with_steps(), one.record, other.drc).problem().type, "tile-damaged");
  EXPECT_EQ(tile_glb(plan_with_steps(), one.record, "no mesh").problem().type, "tile-damaged");
  EXPECT_EQ(tile_glb(proto::Plan(), one.record, one.drc).problem().type, "tile-damaged");
}

TEST_F(OneEncoding, StoresOfFormat1AreReadAsTheyAre) {
  const std::string path = folder_ / "old.sqlite";
  write(path, true);
  Database(path, Database::Mode::create).execute("PRAGMA user_version = 1");
  const auto store = reader(path);
  for (const FinishedTask& task : work_) {
    if (!task.tiles.empty()) { EXPECT_EQ(store->tile(task.node, Encoding::glb)->bytes, task.tiles[0].glb); }
  }
  for (const int version : {0, 3}) {
    Database(path, Database::Mode::create).execute("PRAGMA user_version = " + std::to_string(version));
    EXPECT_EQ(StoreReader::open(path).problem().type, "store-version");
  }
}

TEST_F(OneEncoding, AnUnfinishedStoreOfFormat1GoesOn) {
  const std::string path = folder_ / "half.sqlite";
  {
    auto store = StoreWriter::open(path, plan_with_steps());
    ASSERT_TRUE(store.ok() && (*store)->commit(work_[0]).ok());
  }
  Database(path, Database::Mode::create).execute("PRAGMA user_version = 1");
  auto store = StoreWriter::open(path, plan_with_steps());
  ASSERT_TRUE(store.ok());
  EXPECT_TRUE((*store)->finished(work_[0].node)) << "it was begun anew";
  FinishedTask next = work_[1];
  next.tiles[0].glb.clear();
  ASSERT_TRUE((*store)->commit(next).ok());
  ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
  const auto read = reader(path);
  EXPECT_EQ(read->tile(work_[0].node, Encoding::glb)->bytes, work_[0].tiles[0].glb);
  EXPECT_TRUE(decode_glb(read->tile(next.node, Encoding::glb)->bytes).ok());
  EXPECT_EQ(Database(path, Database::Mode::published).integer("PRAGMA user_version"), 2)
      << "an older program would serve empty tiles";
}

}  // namespace
}  // namespace cordillera::pipeline
