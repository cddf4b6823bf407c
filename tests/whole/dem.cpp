#include "tests/whole/dem.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "proto/lattice.h"

namespace cordillera::whole {
namespace {

namespace fs = std::filesystem;

void must(bool done, const std::string& what) {
  if (!done) throw std::runtime_error(what + ": " + CPLGetLastErrorMsg());
}

Dem lattice_dem(const Corner& corner, double shift_cells, int columns, int rows) {
  const proto::Lattice lattice{corner.level};
  const double cell = lattice.cell_deg();
  Dem dem;
  dem.columns = columns;
  dem.rows = rows;
  dem.level = corner.level;
  dem.geotransform = {lattice.longitude_deg(corner.west) - shift_cells * cell, cell, 0,
                      lattice.latitude_deg(corner.north) + shift_cells * cell, 0,    -cell};
  return dem;
}

/// The same for one place and seed, without order: -1..1.
double hashed(std::uint32_t seed, std::int32_t x, std::int32_t y) {
  std::uint32_t h =
      seed * 0x9E3779B9u ^ static_cast<std::uint32_t>(x) * 0x85EBCA6Bu ^ static_cast<std::uint32_t>(y) * 0xC2B2AE35u;
  for (int k = 0; k < 3; ++k) h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  return static_cast<double>(h) / 2147483648.0 - 1;
}

double smooth_noise(std::uint32_t seed, double x, double y) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto i = static_cast<std::int32_t>(fx), j = static_cast<std::int32_t>(fy);
  const auto eased = [](double t) { return t * t * (3 - 2 * t); };
  const double u = eased(x - fx), v = eased(y - fy);
  return (1 - v) * ((1 - u) * hashed(seed, i, j) + u * hashed(seed, i + 1, j)) +
         v * ((1 - u) * hashed(seed, i, j + 1) + u * hashed(seed, i + 1, j + 1));
}

constexpr int kBlock = 256;

void write_block(GDALRasterBand& band, const Dem& dem, int column, int row) {
  const int columns = std::min(kBlock, dem.columns - column), rows = std::min(kBlock, dem.rows - row);
  std::vector<double> values;
  for (int r = row; r < row + rows; ++r)
    for (int c = column; c < column + columns; ++c) values.push_back(dem.height(c, r));
  if (std::all_of(values.begin(), values.end(), [](double v) { return v == kNoData; })) return;
  must(band.RasterIO(GF_Write, column, row, columns, rows, values.data(), columns, rows, GDT_Float64, 0, 0, nullptr) == CE_None,
       "block");
}

}  // namespace

Dem points_of(const Corner& corner, int columns, int rows, HeightOf height) {
  Dem dem = lattice_dem(corner, 0.5, columns, rows);
  dem.points = true;
  dem.height = std::move(height);
  return dem;
}

Dem cells_of(const Corner& corner, int columns, int rows, HeightOf height) {
  Dem dem = lattice_dem(corner, 0, columns, rows);
  dem.height = std::move(height);
  return dem;
}

double Picture::operator()(int c, int r) const {
  const char at = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  return at == '.' ? kNoData : (at - '0') * unit_m;
}

HeightOf rough(std::uint32_t seed) {
  return [seed](int c, int r) {
    double height = 600, size = 600;
    for (unsigned octave = 0; octave < 7; ++octave, size /= 2.1) {
      const double wave = std::ldexp(1.0, 7 - static_cast<int>(octave));
      height += size * smooth_noise(seed * 31 + octave, c / wave + 0.37, r / wave + 0.61);
    }
    return height;
  };
}

HeightOf rough_with_sea(std::uint32_t seed) {
  return [height = rough(seed)](int c, int r) { return std::max(height(c, r), kSea_m); };
}

Folder::Folder() {
  std::string name = (fs::temp_directory_path() / "cordillera-whole-test-XXXXXX").string();
  must(mkdtemp(name.data()) != nullptr, name);
  path_ = name;
}

Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void write(const Dem& dem, const std::string& path) {
  GDALAllRegister();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
  CPLStringList create;
  for (const char* option : {"TILED=YES", "BLOCKXSIZE=256", "BLOCKYSIZE=256", "SPARSE_OK=TRUE"}) create.AddString(option);
  const GDALDatasetUniquePtr file(driver->Create(path.c_str(), dem.columns, dem.rows, 1, GDT_Float32, create.List()));
  must(file != nullptr, path);
  OGRSpatialReference crs;
  must(crs.SetFromUserInput(dem.crs.c_str()) == OGRERR_NONE, dem.crs);
  must(file->SetSpatialRef(&crs) == CE_None, dem.crs);
  std::array<double, 6> geotransform = dem.geotransform;
  must(file->SetGeoTransform(geotransform.data()) == CE_None, path);
  if (dem.points) file->SetMetadataItem("AREA_OR_POINT", "Point");
  GDALRasterBand* band = file->GetRasterBand(1);
  must(band->SetNoDataValue(kNoData) == CE_None, path);
  for (int r = 0; r < dem.rows; r += kBlock)
    for (int c = 0; c < dem.columns; c += kBlock) write_block(*band, dem, c, r);
}

std::string real_dems() {
  const char* named = std::getenv("CORDILLERA_TEST_DATA");
  const std::string folder = named != nullptr ? named : CORDILLERA_SOURCE_DIR "/../shared/dem";
  return fs::is_directory(folder) ? folder : "";
}

}  // namespace cordillera::whole
