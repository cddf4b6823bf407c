#pragma once
// Datasets that tests of faces look at: of synthetic tiles, and the shipped sample as a build makes it.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/faces/terrain.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::testing {

/// A dataset of level 7 and all above it, from blocks of tiles that it is told, opened.
class Made {
 public:
  Made(const std::vector<std::pair<proto::TileAddress, proto::TileAddress>>& blocks, const Heights& heights, int coarsest = 0,
       const proto::Manifest& manifest = synthetic_manifest()) {
    const proto::Lattice lattice{7};
    auto writer = StoreWriter::open(folder_ / "a.db", synthetic_plan(7, coarsest));
    EXPECT_TRUE(writer.ok());
    for (const auto& [first, last] : blocks) {
      for (FinishedTask& task : synthetic_tasks(lattice, first, last, heights)) {
        if (task.node.z < coarsest) task.tiles.clear();
        EXPECT_TRUE((*writer)->commit(task).ok());
      }
    }
    EXPECT_TRUE((*writer)->publish(manifest).ok());
    terrain_ = std::make_unique<faces::Terrain>(StoreReader::open(folder_ / "a.db").value());
  }
  const faces::Terrain& terrain() const { return *terrain_; }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<faces::Terrain> terrain_;
};

/// The shipped sample, built.
struct BuiltSample {
  BuiltSample() {
    request.raster_path = std::string(CORDILLERA_SOURCE_DIR) + "/deploy/sample/white_mountains_srtm3.tif";
    request.raster_name = "sample.tif";
    request.id = "sample";
    request.store_path = folder / "a.db";
    request.options.set_error(2);
    request.options.set_pixels("lattice");  // faces are looked at, and so small an error at pixels takes long
    request.options.set_threads(2);
    request.options.set_device("cpu");
    const std::atomic<bool> stop = false;
    const auto built = build(request, nullptr, stop);
    if (!built) throw std::runtime_error(built.problem().line());
    terrain = std::make_unique<faces::Terrain>(StoreReader::open(request.store_path).value());
  }
  TemporaryFolder folder;
  BuildRequest request;
  std::unique_ptr<faces::Terrain> terrain;
};

}  // namespace cordillera::pipeline::testing
