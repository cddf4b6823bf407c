#include "fixture.h"

#include <gdal_priv.h>
#include <ogr_spatialref.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

namespace cordillera::raster_test {

namespace fs = std::filesystem;

Spec huge_sparse(int at) {
  Spec spec;
  spec.crs = "EPSG:32632", spec.columns = spec.rows = 100000, spec.geotransform = {500000, 1, 0, 5300000, 0, -1};
  spec.create = {"SPARSE_OK=TRUE", "TILED=YES", "BLOCKXSIZE=512", "BLOCKYSIZE=512", "BIGTIFF=YES"};
  spec.only = Spec::Part{at, at, 512};
  return spec;
}

RasterTest::RasterTest() {
  std::string name = (fs::temp_directory_path() / "cordillera-raster-test-XXXXXX").string();
  folder_ = mkdtemp(name.data());
}

RasterTest::~RasterTest() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

namespace {

void write_pixels(GDALDataset& dataset, const Spec& spec) {
  if (spec.only) {
    std::vector<double> square;
    for (int r = 0; r < spec.only->size; ++r) {
      for (int c = 0; c < spec.only->size; ++c) square.push_back(spec.value(spec.only->column + c, spec.only->row + r));
    }
    EXPECT_EQ(CE_None,
              dataset.GetRasterBand(1)->RasterIO(GF_Write, spec.only->column, spec.only->row, spec.only->size, spec.only->size,
                                                 square.data(), spec.only->size, spec.only->size, GDT_Float64, 0, 0, nullptr));
    return;
  }
  std::vector<double> line(static_cast<std::size_t>(spec.columns));
  for (int b = 1; b <= spec.bands; ++b) {
    for (int r = 0; r < spec.rows; ++r) {
      for (int c = 0; c < spec.columns; ++c) line[static_cast<std::size_t>(c)] = spec.value(c, r);
      EXPECT_EQ(CE_None, dataset.GetRasterBand(b)->RasterIO(GF_Write, 0, r, spec.columns, 1, line.data(), spec.columns, 1,
                                                            GDT_Float64, 0, 0, nullptr));
    }
  }
  if (!spec.mask) return;
  CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
  EXPECT_EQ(CE_None, dataset.CreateMaskBand(GMF_PER_DATASET));
  for (int r = 0; r < spec.rows; ++r) {
    for (int c = 0; c < spec.columns; ++c) line[static_cast<std::size_t>(c)] = spec.mask(c, r) ? 255 : 0;
    EXPECT_EQ(CE_None, dataset.GetRasterBand(1)->GetMaskBand()->RasterIO(GF_Write, 0, r, spec.columns, 1, line.data(),
                                                                         spec.columns, 1, GDT_Float64, 0, 0, nullptr));
  }
  CPLSetThreadLocalConfigOption("GDAL_TIFF_INTERNAL_MASK", nullptr);
}

}  // namespace

std::string RasterTest::write(const Spec& spec, const std::string& name) const {
  GDALAllRegister();
  CPLStringList create;
  for (const std::string& option : spec.create) create.AddString(option.c_str());
  const bool copy = spec.driver != "GTiff";
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(copy ? "MEM" : "GTiff");
  const std::string file = path(name);
  GDALDatasetUniquePtr dataset(driver->Create(file.c_str(), spec.columns, spec.rows, spec.bands,
                                              GDALGetDataTypeByName(spec.type.c_str()), copy ? nullptr : create.List()));
  if (spec.georeferenced) dataset->SetGeoTransform(const_cast<double*>(spec.geotransform.data()));
  if (spec.point) dataset->SetMetadataItem("AREA_OR_POINT", "Point");
  OGRSpatialReference srs;
  if (!spec.crs.empty()) {
    EXPECT_EQ(OGRERR_NONE, srs.SetFromUserInput(spec.crs.c_str())) << spec.crs;
    dataset->SetSpatialRef(&srs);
  }
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (spec.nodata) band->SetNoDataValue(*spec.nodata);
  if (spec.scale != 1) band->SetScale(spec.scale);
  if (spec.offset != 0) band->SetOffset(spec.offset);
  if (!spec.unit.empty()) band->SetUnitType(spec.unit.c_str());
  write_pixels(*dataset, spec);
  if (copy) {
    GDALDriver* target = GetGDALDriverManager()->GetDriverByName(spec.driver.c_str());
    const GDALDatasetUniquePtr written(target->CreateCopy(file.c_str(), dataset.get(), FALSE, create.List(), nullptr, nullptr));
    EXPECT_TRUE(written) << CPLGetLastErrorMsg();
  }
  return file;
}

std::string RasterTest::write_text(const std::string& text, const std::string& name) const {
  std::ofstream(path(name), std::ios::binary) << text;
  return path(name);
}

proto::BuildOptions plain_options() {
  proto::BuildOptions options;
  options.set_vertical_datum("ellipsoid");
  return options;
}

proto::Result<std::unique_ptr<raster::Source>> open(const std::string& path, const proto::BuildOptions& options,
                                                    raster::Trust trust, const std::string& name) {
  return raster::open_source(path, name, trust, options);
}

std::unique_ptr<raster::Source> must_open(const std::string& path, const proto::BuildOptions& options, raster::Trust trust,
                                          const std::string& name) {
  auto source = open(path, options, trust, name);
  if (source.ok()) return std::move(*source);
  ADD_FAILURE() << source.problem().type << ": " << source.problem().line();
  return nullptr;
}

std::string problem_type(const std::string& path, const proto::BuildOptions& options, raster::Trust trust,
                         const std::string& name) {
  auto source = open(path, options, trust, name);
  if (source.ok()) return "";
  EXPECT_FALSE(source.problem().detail.empty());
  return source.problem().type;
}

std::array<double, 6> cells_of(int level, std::int64_t west, std::int64_t north) {
  const proto::Lattice l = lattice(level);
  return {l.longitude_deg(west), l.cell_deg(), 0, l.latitude_deg(north), 0, -l.cell_deg()};
}

double height_m(raster::Source& source, const proto::Lattice& l, std::int64_t i, std::int64_t j) {
  auto samples = source.sample(l, i, j, 1, 1);
  EXPECT_TRUE(samples.ok()) << samples.problem().line();
  if (!samples.ok() || samples->height[0] == proto::kNoHeight) return std::nan("");
  return samples->height[0] * proto::kHeightStep_m;
}

proto::Samples whole(raster::Source& source, const proto::Lattice& l) {
  const auto w = source.window(l);
  auto samples = source.sample(l, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                               static_cast<std::int32_t>(w.north - w.south + 1));
  EXPECT_TRUE(samples.ok()) << samples.problem().line();
  return samples.ok() ? std::move(*samples) : proto::Samples{};
}

double valid_share(const proto::Samples& samples) {
  std::size_t valid = 0;
  for (const std::int32_t h : samples.height) valid += h != proto::kNoHeight;
  return samples.height.empty() ? 0 : static_cast<double>(valid) / static_cast<double>(samples.height.size());
}

std::string real_dems() {
  const char* named = std::getenv("CORDILLERA_TEST_DATA");
  const std::string folder = named != nullptr ? named : CORDILLERA_SOURCE_DIR "/../shared/dem";
  return fs::is_directory(folder) ? folder : "";
}

}  // namespace cordillera::raster_test
