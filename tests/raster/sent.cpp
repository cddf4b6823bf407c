#include "sent.h"

#include <cpl_vsi.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "proto/mesh.h"

namespace cordillera::raster_test {
namespace {

void put(const std::string& path, const std::string& bytes) {
  VSILFILE* const file = VSIFOpenL(path.c_str(), "wb");
  ASSERT_NE(file, nullptr) << path;
  EXPECT_EQ(VSIFWriteL(bytes.data(), 1, bytes.size(), file), bytes.size());
  EXPECT_EQ(VSIFCloseL(file), 0);
}

}  // namespace

std::string bytes_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void zip_bytes(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files) {
  // Without this handle GDAL would begin the zip anew for every file.
  const std::string zip = "/vsizip/" + path;
  VSILFILE* const whole = VSIFOpenL(zip.c_str(), "wb");
  ASSERT_NE(whole, nullptr) << path;
  for (const auto& [name, bytes] : files) put(zip + "/" + name, bytes);
  EXPECT_EQ(VSIFCloseL(whole), 0);
}

void zip_files(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files) {
  std::vector<std::pair<std::string, std::string>> bytes;
  for (const auto& [name, file] : files) bytes.emplace_back(name, bytes_of(file));
  zip_bytes(path, bytes);
}

void gzip_file(const std::string& path, const std::string& file) { put("/vsigzip/" + path, bytes_of(file)); }

Spec hills() {
  Spec spec;
  spec.columns = 61, spec.rows = 47, spec.type = "Int16", spec.nodata = -9999;
  spec.value = [](int c, int r) {
    return c == 30 && r == 20 ? -9999 : std::round(400 + 300 * std::sin(c * 0.3) + 80 * std::cos(r * 0.2)) - 500;
  };
  return spec;
}

std::vector<SentRow> sent_rows() {
  return {{"netCDF classic", "netCDF", "dem.nc", {}},
          {"netCDF with 64-bit offsets", "netCDF", "dem.nc", {"FORMAT=NC2"}},
          {"netCDF-4, deflated", "netCDF", "dem.nc", {"FORMAT=NC4", "COMPRESS=DEFLATE"}, "Float32"},
          {"netCDF, north first", "netCDF", "dem.nc", {"WRITE_BOTTOMUP=NO"}, "Float64"},
          {"HFA", "HFA", "dem.img", {}},
          {"HFA, compressed", "HFA", "dem.img", {"COMPRESSED=YES"}, "Float32"},
          {"XYZ, blanks", "XYZ", "dem.xyz", {}, "Float32", {}, false},
          {"XYZ, commas and a header", "XYZ", "dem.xyz", {"COLUMN_SEPARATOR=,", "ADD_HEADER_LINE=YES"}, "Int16", {}, false},
          {"GeoPackage, float", "GPKG", "dem.gpkg", {"TILE_FORMAT=TIFF", "GRID_CELL_ENCODING=grid-value-is-area"}, "Float32"},
          {"GeoPackage, whole numbers", "GPKG", "dem.gpkg", {"GRID_CELL_ENCODING=grid-value-is-area"}},
          {"JPEG 2000", "JP2OpenJPEG", "dem.jp2", {"REVERSIBLE=YES", "QUALITY=100"}},
          {"EHdr .bil", "EHdr", "dem.bil", {}, "Int16", {"dem.hdr", "dem.prj"}},
          {"EHdr .flt", "EHdr", "dem.flt", {}, "Float32", {"dem.hdr", "dem.prj"}},
          {"ERS", "ERS", "dem.ers", {}, "Float32", {"dem"}, false},
          {"SAGA", "SAGA", "dem.sdat", {}, "Float32", {"dem.sgrd", "dem.prj"}},
          {"Esri ASCII", "AAIGrid", "dem.asc", {}, "Int16", {"dem.prj"}}};
}

bool SentRow::says_nodata() const { return std::string(driver) != "XYZ" && std::string(driver) != "JP2OpenJPEG"; }

std::vector<std::pair<std::string, std::string>> files_of(const SentRow& row, const std::string& file) {
  namespace fs = std::filesystem;
  std::vector<std::pair<std::string, std::string>> files{{row.file, file}};
  for (const std::string& name : row.beside) files.emplace_back(name, (fs::path(file).parent_path() / name).string());
  fs::remove(file + ".aux.xml");
  return files;
}

void expect_same_heights(raster::Source& a, raster::Source& b) {
  const proto::Lattice l = lattice(8);
  const proto::Samples one = whole(a, l), other = whole(b, l);
  ASSERT_EQ(one.columns, other.columns);
  ASSERT_EQ(one.height.size(), other.height.size());
  ASSERT_GT(valid_share(one), 0.5);
  int different = 0;
  for (std::size_t k = 0; k < one.height.size(); ++k) {
    const bool both = one.height[k] != proto::kNoHeight && other.height[k] != proto::kNoHeight;
    // A vertex upon the rim may fall on either side of it.
    if (both && std::abs(one.height[k] - other.height[k]) * proto::kHeightStep_m > 0.01) ++different;
    if (!both && one.height[k] != other.height[k])
      different += (k % static_cast<std::size_t>(one.columns)) % static_cast<std::size_t>(one.columns - 1) != 0;
  }
  EXPECT_EQ(different, 0);
}

}  // namespace cordillera::raster_test
