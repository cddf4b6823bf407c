#pragma once
// Stores of tiles without a build: written, published, opened.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "pipeline/store/store.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline::testing {

inline const proto::Lattice kLattice{6};

inline std::vector<FinishedTask> tasks() { return synthetic_tasks(kLattice, {6, 62, 40}, {6, 67, 43}, hills_with_voids()); }

inline std::unique_ptr<StoreWriter> writer(const std::string& path, const proto::Plan& plan) {
  auto opened = StoreWriter::open(path, plan);
  EXPECT_TRUE(opened.ok()) << opened.problem().line();
  return std::move(opened).value();
}

inline std::unique_ptr<StoreReader> reader(const std::string& path) {
  auto opened = StoreReader::open(path);
  EXPECT_TRUE(opened.ok()) << opened.problem().line();
  return std::move(opened).value();
}

inline proto::Manifest write_store(const std::string& path, const std::vector<FinishedTask>& work) {
  auto store = writer(path, synthetic_plan(6));
  for (const FinishedTask& task : work) EXPECT_TRUE(store->commit(task).ok());
  auto manifest = store->publish(synthetic_manifest());
  EXPECT_TRUE(manifest.ok()) << manifest.problem().line();
  EXPECT_TRUE(StoreReader::open(path).ok()) << "readable at once, while the writer still lives";
  return *manifest;
}

}  // namespace cordillera::pipeline::testing
