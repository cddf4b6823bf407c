// The laws on every real elevation model of the optional test data, and the Los Angeles pair.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "pipeline/plan/plan.h"
#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

constexpr double kMostSamples = 1.0e6;  ///< larger ones are built to a coarser level

std::vector<std::string> files() {
  std::vector<std::string> found;
  if (real_dems().empty()) return {""};
  for (const auto& entry : std::filesystem::directory_iterator(real_dems())) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".tif" || extension == ".hgt" || extension == ".dem") found.push_back(entry.path().filename().string());
  }
  std::sort(found.begin(), found.end());
  return found.empty() ? std::vector<std::string>{""} : found;
}

/// The finest level at which the window holds no more than kMostSamples. coarser: than the raster's own.
void bound_samples(const std::string& path, proto::BuildOptions& options, bool& coarser) {
  const auto source =
      raster::open_source(path, std::filesystem::path(path).filename().string(), raster::Trust::operator_file, options);
  ASSERT_TRUE(source.ok()) << source.problem().line();
  const auto plan = pipeline::make_plan(**source, options);
  ASSERT_TRUE(plan.ok()) << plan.problem().line();
  double samples = (plan->window(2) - plan->window(0) + 1.0) * (plan->window(3) - plan->window(1) + 1.0);
  int level = static_cast<int>(plan->finest_level());
  for (; samples > kMostSamples; samples /= 4) --level;
  coarser = level < static_cast<int>(plan->finest_level());
  options.set_max_level(static_cast<std::uint32_t>(level));
}

class RealDem : public testing::TestWithParam<std::string> {};
TEST_P(RealDem, obeys_the_laws_and_keeps_its_target_at_its_own_pixels) {
  if (GetParam().empty()) GTEST_SKIP() << "no real elevation models: set CORDILLERA_TEST_DATA to a folder of them";
  const std::string path = real_dems() + "/" + GetParam();
  proto::BuildOptions options;
  options.set_threads(2);
  options.set_device("cpu");
  bool coarser = false;
  ASSERT_NO_FATAL_FAILURE(bound_samples(path, options, coarser));
  const Built built = build_file(path, options);
  EXPECT_THAT(judge(built, {8000, 0}), IsEmpty());
  EXPECT_GT(built.triangles(built.lattice.finest_level), 100u);
  if (coarser) return;  // docs/design/accuracy.md has what came out at pixels of larger ones
  const proto::ErrorAtPixels& stated = built.manifest.source().error_at_pixels();
  EXPECT_GT(stated.pixels(), 1000);
  EXPECT_LE(stated.max(), 1.1 * pipeline::level_plan(built.plan, built.lattice.finest_level).target());
}

INSTANTIATE_TEST_SUITE_P(whole, RealDem, testing::ValuesIn(files()), [](const auto& param) {
  std::string name = param.param.empty() ? "absent" : param.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
});

TEST(real_dem, the_los_angeles_pair_agrees) {
  const std::string geoid = real_dems() + "/geoid/egm_08_los_angeles.tif";
  if (real_dems().empty() || !std::filesystem::exists(geoid))
    GTEST_SKIP() << "no Los Angeles pair: set CORDILLERA_TEST_DATA to a folder that has it";
  proto::BuildOptions orthometric = with_error(1), ellipsoidal = with_error(1);
  orthometric.set_vertical_datum(geoid);
  const Built a = build_file(real_dems() + "/glo30_los_angeles_egm2008.tif", orthometric);
  const Built b = build_file(real_dems() + "/glo30_los_angeles_ellipsoid.tif", ellipsoidal);
  ASSERT_EQ(a.samples.height.size(), b.samples.height.size());
  EXPECT_GT(a.samples.height.size(), 100000u);
  double worst = 0;
  for (std::size_t k = 0; k < a.samples.height.size(); ++k)
    worst = std::max(worst, std::abs(a.samples.height[k] - b.samples.height[k]) * proto::kHeightStep_m);
  EXPECT_LE(worst, 0.1);
  // And as decoded: the surface of one, against the samples of the other.
  EXPECT_THAT(judge(a, {8000, 0}), IsEmpty());
  for (const auto& [at, tile] : b.finest()) {
    const Measured measured = measure(
        surface_of(tile.drc), b.lattice, at, [&](std::int64_t i, std::int64_t j) { return a.truth(i, j); }, 3);
    EXPECT_GT(measured.samples, 0u);
    EXPECT_LE(measured.max_m, tile.record.max_error() + 0.1);
  }
}

}  // namespace
}  // namespace cordillera::whole
