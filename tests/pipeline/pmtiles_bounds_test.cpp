// What whoever has an archive made lets it take.
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "pipeline/exports/pmtiles.h"
#include "tests/pipeline/archived_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using testing::archived_dataset;

TEST(PmtilesBounds, AnArchiveOfTooManyTilesEndsWithTheFirstThatIsTooMuch) {
  constexpr std::uint64_t kMost = 5;
  std::vector<std::uint64_t> asked;
  std::uint64_t bytes = 0;
  ArchiveBounds bounds;
  bounds.tiles = [&](std::uint64_t tiles) -> std::optional<proto::Problem> {
    asked.push_back(tiles);
    if (tiles <= kMost) return std::nullopt;
    return proto::Problem{"export-too-large", "too many", "fewer", ""};
  };
  bounds.bytes = [&](std::uint64_t more) -> std::optional<proto::Problem> {
    bytes += more;
    return std::nullopt;
  };
  const std::string file = archived_dataset().place("bounded.pmtiles");
  const auto written = write_pmtiles(archived_dataset().terrain(), *faces::face_named("terrain-rgb"), file, bounds);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.problem().type, "export-too-large");
  EXPECT_EQ(asked, (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6}));
  EXPECT_GT(bytes, 0u) << "those before it are written by then: none is drawn only to be counted";
  EXPECT_FALSE(std::filesystem::exists(file));
}

TEST(PmtilesBounds, AnArchiveThatMayTakeNoMoreBytesEnds) {
  ArchiveBounds bounds;
  int asked = 0;
  bounds.bytes = [&](std::uint64_t) -> std::optional<proto::Problem> {
    if (++asked < 3) return std::nullopt;
    return proto::Problem{"storage-full", "full", "room", ""};
  };
  const std::string file = archived_dataset().place("full.pmtiles");
  const auto written = write_pmtiles(archived_dataset().terrain(), *faces::face_named("terrain-rgb"), file, bounds);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.problem().type, "storage-full");
  EXPECT_EQ(asked, 3);
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace cordillera::pipeline::exports
