#pragma once
// The dataset that exports are tested on: level 7 on both sides of Greenwich, with lakes of nothing if wanted.
#include <memory>
#include <string>

#include "pipeline/faces/terrain.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::testing {

inline const proto::Lattice kExportLattice{7};
inline const proto::TileAddress kFirstTile{7, 126, 80}, kLastTile{7, 131, 85};

class ExportDataset {
 public:
  explicit ExportDataset(const Heights& heights, const proto::TileAddress& first = kFirstTile,
                         const proto::TileAddress& last = kLastTile) {
    auto writer = StoreWriter::open(folder_ / "a.db", synthetic_plan(7, 0)).value().release();
    for (const FinishedTask& task : synthetic_tasks(kExportLattice, first, last, heights)) (void)writer->commit(task);
    (void)writer->publish(synthetic_manifest());
    delete writer;
    terrain_ = std::make_unique<faces::Terrain>(StoreReader::open(folder_ / "a.db").value());
  }
  const faces::Terrain& terrain() const { return *terrain_; }
  std::string place(const std::string& name) const { return folder_ / name; }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<faces::Terrain> terrain_;
};

inline const ExportDataset& plain_dataset() {
  static const ExportDataset kDataset(hills());
  return kDataset;
}
inline const ExportDataset& holed_dataset() {
  static const ExportDataset kDataset(hills_with_voids());
  return kDataset;
}

}  // namespace cordillera::pipeline::testing
