// A text grid is read once for all that open it, into a copy that is nobody's after them.
#include "raster/open/text_rows.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/disk/free_space.h"
#include "raster/pixels/decimation.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;
using raster::Trust;

constexpr int kSide = 300;

/// Whole numbers, or such with a fraction. torn: the row that is damaged; after it the file ends.
std::string grid(const std::string& fraction, int torn = kSide) {
  std::string text = "ncols 300\nnrows 300\nxllcorner 10\nyllcorner 45\ncellsize 0.01\nNODATA_value -9999\n";
  for (int row = 0; row < torn; ++row) {
    for (int column = 0; column < kSide; ++column)
      text += (column == row ? "-9999" : std::to_string(100 + column + 3 * row % 7) + fraction) + " ";
    text += "\n";
  }
  return text + (torn < kSide ? std::string(90000, '7') : "");
}

/// With a temporary folder of its own.
class TextRows : public RasterTest {
 protected:
  TextRows() {
    options_.set_crs("EPSG:4326");
    fs::create_directory(path("tmp"));
    if (const char* usual = std::getenv("TMPDIR")) before_ = usual;
    setenv("TMPDIR", path("tmp").c_str(), 1);
  }
  ~TextRows() override { before_ ? setenv("TMPDIR", before_->c_str(), 1) : unsetenv("TMPDIR"); }

  std::ptrdiff_t folders() const { return std::distance(fs::directory_iterator(path("tmp")), {}); }

  proto::BuildOptions options_ = plain_options();

 private:
  std::optional<std::string> before_;
};

TEST_F(TextRows, AreThoseOfTheSameRasterInAnotherFormat) {
  for (const char* fraction : {"", ".25"}) {
    const std::string text = write_text(grid(fraction), "dem.asc");
    Spec spec;
    spec.columns = spec.rows = kSide;
    spec.geotransform = {10, 0.01, 0, 48, 0, -0.01};
    spec.nodata = -9999;
    spec.value = [&](int c, int r) { return c == r ? -9999 : 100 + c + 3 * r % 7 + (*fraction == 0 ? 0 : 0.25); };
    const auto one = must_open(text, options_), same = must_open(write(spec), options_);
    ASSERT_TRUE(one && same);
    const proto::Samples a = whole(*one, lattice(8)), b = whole(*same, lattice(8));
    EXPECT_EQ(a.height, b.height) << fraction;
    EXPECT_GT(valid_share(a), 0.5);
  }
}

/// As if the file had not changed nobody reads it again, be it posted, which is opened by another link each time, or not. What is
/// in it then would be refused.
TEST_F(TextRows, AreReadOnce) {
  for (const Trust trust : {Trust::operator_file, Trust::posted_file}) {
    const std::string name = trust == Trust::posted_file ? "posted.asc" : "own.asc";
    const std::string text = grid(""), file = write_text(text, name);
    const auto one = must_open(file, options_, trust, "dem.asc");
    ASSERT_TRUE(one);
    const std::vector<std::int32_t> heights = whole(*one, lattice(8)).height;
    const auto time = fs::last_write_time(file);
    const std::size_t header = text.find("-9999 ") + 6;
    write_text(text.substr(0, header) + std::string(text.size() - header, 'x'), name);
    fs::last_write_time(file, time);
    const auto other = must_open(file, options_, trust, "dem.asc");
    ASSERT_TRUE(other);
    EXPECT_EQ(whole(*other, lattice(8)).height, heights);
    fs::last_write_time(file, time + std::chrono::seconds(1));
    EXPECT_EQ(problem_type(file, options_, trust, "dem.asc"), "raster-unreadable");
  }
}

TEST_F(TextRows, HaveOneCopyForAllThreads) {
  const std::string file = write_text(grid(".5"), "dem.asc");
  std::vector<std::unique_ptr<raster::Source>> sources;
  for (int k = 0; k < 8; ++k) sources.push_back(must_open(file, options_));
  EXPECT_EQ(folders(), 0) << "none is made before pixels are asked for";
  std::vector<std::future<std::vector<std::int32_t>>> asked;
  for (const auto& source : sources)
    asked.push_back(std::async(std::launch::async, [&source] { return whole(*source, lattice(8)).height; }));
  const auto first = asked.front().get();
  for (std::size_t k = 1; k < asked.size(); ++k) EXPECT_EQ(asked[k].get(), first) << k;
  EXPECT_EQ(folders(), 1);
}

TEST_F(TextRows, NeedRoom) {
  const auto source = must_open(write_text(grid(".5"), "dem.asc"), options_);
  ASSERT_TRUE(source);
  const auto window = source->window(lattice(8));
  const auto problem = [&] {
    const auto samples = source->sample(lattice(8), window.west, window.south, 4, 4);
    return samples.ok() ? "" : samples.problem().line();
  };
  raster::keep_free(fs::space(path("tmp")).available);
  EXPECT_THAT(problem(), testing::HasSubstr("there is no room for a copy of dem.asc"));
  EXPECT_EQ(folders(), 0);
  raster::keep_free(0);
  EXPECT_EQ(problem(), "");
  setenv("TMPDIR", path("none").c_str(), 1);
  const auto other = must_open(write_text(grid(".5"), "other.asc"), options_);
  ASSERT_TRUE(other);
  const auto samples = other->sample(lattice(8), window.west, window.south, 4, 4);
  ASSERT_FALSE(samples.ok());
  EXPECT_EQ(samples.problem().type, "storage-full");
}

/// A look over all rows is told which is damaged; what lies before it is read (see BadInput, too).
TEST_F(TextRows, EndAtADamagedOne) {
  const auto source = must_open(write_text(grid("", 200), "torn.asc"), options_);
  ASSERT_TRUE(source);
  const auto looked = source->decimate(raster::kPixelsLookedAt);
  ASSERT_FALSE(looked.ok());
  EXPECT_EQ(looked.problem().type, "raster-unreadable");
  EXPECT_THAT(looked.problem().detail, testing::HasSubstr("row 201 of 300"));
  const auto w = source->window(lattice(8));
  EXPECT_FALSE(source->sample(lattice(8), w.west, w.south, 8, 8).ok());
  EXPECT_TRUE(source->sample(lattice(8), w.west, w.north - 20, 8, 8).ok());
}

}  // namespace
}  // namespace cordillera::raster_test
