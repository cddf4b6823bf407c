#include "pipeline/build/worker_sources.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace cordillera::pipeline {
namespace {

proto::Result<std::unique_ptr<raster::Source>> open_slope() {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "slope.asc").string();
  std::ofstream(path) << "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 46\ncellsize 1\n1 2\n3 4\n";
  proto::BuildOptions options;
  options.set_crs("EPSG:4326");
  options.set_vertical_datum("ellipsoid");
  return raster::open_source(path, "slope.asc", raster::Trust::operator_file, options);
}

const proto::Problem kGone{"raster-missing", "it is gone", "", ""};

TEST(WorkerSources, EachWorkerHasOne) {
  WorkerSources sources;
  ASSERT_TRUE(sources.open(3, open_slope).ok());
  const auto third = sources.of(2), first = sources.of(0);
  ASSERT_TRUE(first.ok() && third.ok());
  EXPECT_NE(*first, *third);
  EXPECT_EQ((*third)->description().columns(), 2u);
}

TEST(WorkerSources, OfThoseThatCannotBeOpenedTheReasonIsTold) {
  std::atomic<int> opened{0};
  WorkerSources sources;
  ASSERT_TRUE(sources
                  .open(4,
                        [&]() -> proto::Result<std::unique_ptr<raster::Source>> {
                          if (++opened == 3) return kGone;
                          return open_slope();
                        })
                  .ok());
  EXPECT_EQ(sources.of(3).problem().type, "raster-missing");
  EXPECT_EQ(sources.of(2).problem().type, "raster-missing");
  EXPECT_TRUE(sources.of(1).ok() && sources.of(0).ok());
  EXPECT_EQ(opened, 3) << "no other is tried";
  EXPECT_EQ(WorkerSources().open(4, [] { return kGone; }).problem().type, "raster-missing");
}

TEST(WorkerSources, WhatIsThrownMeetsWhoWaits) {
  std::atomic<int> opened{0};
  WorkerSources sources;
  ASSERT_TRUE(sources.open(2, [&] { return ++opened == 2 ? throw std::runtime_error("no") : open_slope(); }).ok());
  EXPECT_THROW(static_cast<void>(sources.of(1)), std::runtime_error);
  EXPECT_TRUE(sources.of(0).ok());
}

}  // namespace
}  // namespace cordillera::pipeline
