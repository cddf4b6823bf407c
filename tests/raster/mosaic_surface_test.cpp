// The surface that tells which pixels count is that of the samples that are asked for next.
#include <filesystem>

#include "raster/mosaic/mosaic.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

using MosaicSurface = RasterTest;

/// Of more rasters than stay open: read a second time, those whose files have gone would be missed.
TEST_F(MosaicSurface, IsLaidOnceForPixelsAndSamples) {
  constexpr int kRasters = 72, kSide = 16, kFine = 12;
  constexpr std::int64_t kColumn = 900000, kRow = 700000;
  std::vector<raster::MosaicMember> members;
  for (int k = 0; k < kRasters; ++k) {
    Spec spec;
    spec.columns = spec.rows = kSide;
    spec.geotransform = cells_of(kFine, kColumn + kSide * (k % 8), kRow - kSide * (k / 8));
    spec.value = [k](int c, int r) { return 100 + 7 * k + c + 2 * r; };
    const std::string name = "r" + std::to_string(k) + ".tif";
    const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
    ASSERT_TRUE(member.ok()) << member.problem().line();
    members.push_back(*member);
  }
  const raster::Source::Window over{kColumn, kRow - 9 * kSide, kColumn + 8 * kSide, kRow};
  const auto sampled = [&](raster::Source& source) {
    return source.sample(lattice(kFine), over.west, over.south, static_cast<std::int32_t>(over.east - over.west + 1),
                         static_cast<std::int32_t>(over.north - over.south + 1));
  };
  const auto other = raster::make_mosaic(members, 0), mosaic = raster::make_mosaic(members, 0);
  const auto expected = sampled(*other);
  ASSERT_TRUE(expected.ok());
  const auto pixels = mosaic->pixels(lattice(kFine), over);
  ASSERT_TRUE(pixels.ok());
  EXPECT_EQ(pixels->size(), static_cast<std::size_t>(kRasters * kSide * kSide));
  for (const auto& member : members) std::filesystem::remove(member.path);
  const auto samples = sampled(*mosaic);
  ASSERT_TRUE(samples.ok()) << samples.problem().line();
  EXPECT_EQ(samples->height, expected->height);
  EXPECT_EQ(samples->flat_water, expected->flat_water);
  EXPECT_FALSE(sampled(*mosaic).ok()) << "it is not kept any longer: the test tests nothing otherwise";
}

}  // namespace
}  // namespace cordillera::raster_test
