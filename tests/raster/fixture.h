#pragma once
// Small rasters made on the spot, and what a test asks of a source.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "raster/source.h"

namespace cordillera::raster_test {

/// A raster to be written. Defaults: 8 x 8 float32 pixels of the lattice's own size at 10 E, 45 N, height 100 m.
struct Spec {
  int columns = 8, rows = 8;
  std::array<double, 6> geotransform{10, 0.01, 0, 45, 0, -0.01};
  std::string crs = "EPSG:4326";  ///< empty: none
  std::string type = "Float32";   ///< GDAL's name
  std::function<double(int c, int r)> value = [](int, int) { return 100.0; };
  std::function<bool(int c, int r)> mask;  ///< set: per-dataset mask, true = valid
  std::optional<double> nodata;
  double scale = 1, offset = 0;
  std::string unit;
  bool point = false;
  int bands = 1;
  std::vector<std::string> create;  ///< creation options
  std::string driver = "GTiff";
  bool georeferenced = true;
  struct Part {
    int column, row, size;
  };
  std::optional<Part> only;  ///< set: only this square is written, the rest of a sparse file never
};

/// 100,000 x 100,000 samples, of which one block of 512 x 512 is written, from column and row `at`.
Spec huge_sparse(int at);

/// A folder of its own for each test, removed afterwards.
class RasterTest : public ::testing::Test {
 protected:
  RasterTest();
  ~RasterTest() override;
  std::string write(const Spec& spec, const std::string& name = "dem.tif") const;
  std::string write_text(const std::string& text, const std::string& name) const;
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

 private:
  std::filesystem::path folder_;
};

/// Ellipsoidal heights unless a test says otherwise: what goes in comes out.
proto::BuildOptions plain_options();

proto::Result<std::unique_ptr<raster::Source>> open(const std::string& path, const proto::BuildOptions& options = plain_options(),
                                                    raster::Trust trust = raster::Trust::operator_file,
                                                    const std::string& name = "");
/// The source, or a failed test and null.
std::unique_ptr<raster::Source> must_open(const std::string& path, const proto::BuildOptions& options = plain_options(),
                                          raster::Trust trust = raster::Trust::operator_file, const std::string& name = "");
/// The slug of the problem that opening gives; empty when it opens.
std::string problem_type(const std::string& path, const proto::BuildOptions& options = plain_options(),
                         raster::Trust trust = raster::Trust::operator_file, const std::string& name = "");

inline proto::Lattice lattice(int level) { return {level}; }
/// A geotransform whose pixels are the cells of a level, first pixel's corner at vertex (west, north).
std::array<double, 6> cells_of(int level, std::int64_t west, std::int64_t north);

/// Height in metres at a vertex; NaN where void.
double height_m(raster::Source& source, const proto::Lattice& lattice, std::int64_t i, std::int64_t j);
/// All samples of the source's window.
proto::Samples whole(raster::Source& source, const proto::Lattice& lattice);
/// Share of valid samples.
double valid_share(const proto::Samples& samples);

/// Folder of real elevation models: $CORDILLERA_TEST_DATA, else ../shared/dem beside the checkout; empty when absent.
std::string real_dems();

}  // namespace cordillera::raster_test
