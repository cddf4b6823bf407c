#include "raster/pixels/decimation.h"

#include <cpl_string.h>

#include <algorithm>
#include <cmath>

#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/open/dataset.h"
#include "raster/open/text_rows.h"

namespace cordillera::raster {
namespace {

constexpr std::int64_t kMostOverviewBlock_px = 16 << 20;  // an overview's header is nobody's promise

/// A band to read from, with its mask, if it has one: the raster's own or an overview's.
struct Image {
  GDALRasterBand* band = nullptr;
  GDALRasterBand* mask = nullptr;
};

std::int64_t pixels_of(GDALRasterBand& band) { return std::int64_t{band.GetXSize()} * band.GetYSize(); }

/// An overview as an image; none where its mask, type or blocks are not what the raster's are.
Image overview(const Dataset& dataset, int k) {
  Image image{dataset.band->GetOverview(k), nullptr};
  if (image.band == nullptr || image.band->GetRasterDataType() != dataset.band->GetRasterDataType()) return {};
  int columns = 0, rows = 0;
  image.band->GetBlockSize(&columns, &rows);
  if (std::int64_t{columns} * rows > kMostOverviewBlock_px) return {};
  if (dataset.mask == nullptr) return image;
  if (k < dataset.mask->GetOverviewCount())
    image.mask = dataset.mask->GetOverview(k);
  else if ((image.band->GetMaskFlags() & GMF_ALL_VALID) == 0)
    image.mask = image.band->GetMaskBand();
  const bool fits = image.mask != nullptr && image.mask->GetXSize() == image.band->GetXSize() &&
                    image.mask->GetYSize() == image.band->GetYSize();
  return fits ? image : Image{};
}

/// Of what is wanted, what an overview has at least. With a little less than a pixel a sample nothing is lost to see, and the
/// next larger image is four times as much to read.
constexpr double kEnough = 0.75;

/// What a VRT calls its overviews may be made of its rasters' pixels, all of them.
bool has_overviews(const Dataset& dataset) {
  if (dataset.driver != "VRT") return true;
  const CPLStringList files(dataset.handle->GetFileList());  // its own first
  if (files.size() < 2) return true;
  const std::vector<const char*> allowed = allowed_drivers(files[1], dataset.trust, false);
  const GDALDatasetUniquePtr one(
      GDALDataset::Open(files[1], GDAL_OF_RASTER | GDAL_OF_READONLY, allowed.data(), nullptr, nullptr));
  return one && one->GetRasterCount() > 0 && one->GetRasterBand(1)->GetOverviewCount() > 0;
}

/// The smallest image that has about as many pixels as are wanted.
Image image_for(const Dataset& dataset, std::int64_t samples) {
  const auto wanted = static_cast<std::int64_t>(kEnough * static_cast<double>(samples));
  Image best{dataset.band, dataset.mask};
  if (dataset.band->GetOverviewCount() == 0 || !has_overviews(dataset)) return best;
  for (int k = 0; k < dataset.band->GetOverviewCount(); ++k) {
    const Image image = overview(dataset, k);
    if (image.band != nullptr && pixels_of(*image.band) >= wanted && pixels_of(*image.band) < pixels_of(*best.band)) best = image;
  }
  return best;
}

/// Of the blocks that some of so many rows and columns, spread evenly, lie in.
double decoded_px(GDALRasterBand& band, int columns, int rows) {
  int width = 0, height = 0;
  band.GetBlockSize(&width, &height);
  const auto touched = [](int size, int block, int lines) { return std::min(lines, (size + block - 1) / block); };
  return 1.0 * touched(band.GetXSize(), width, columns) * width * touched(band.GetYSize(), height, rows) * height;
}

/// Where line k of `count` is read in an image that is `size` long.
int line_at(int k, int count, int size) { return std::min(size - 1, static_cast<int>((k + 0.5) * size / count)); }

/// Rows of `columns` pixels out of the first `width` of the image, one after the other.
proto::Result<void> read_rows(const Dataset& dataset, GDALRasterBand& band, int width, const Decimation& size, GDALDataType type,
                              std::uint8_t* out) {
  const GdalScope scope(dataset.trust);
  const std::size_t line_bytes =
      static_cast<std::size_t>(size.columns) * static_cast<std::size_t>(GDALGetDataTypeSizeBytes(type));
  for (int row = 0; row < size.rows; ++row, out += line_bytes) {
    const int y = line_at(row, size.rows, band.GetYSize());
    if (band.RasterIO(GF_Read, 0, y, width, 1, out, size.columns, 1, type, 0, 0, nullptr) == CE_None && !scope.failed()) continue;
    return unreadable_pixels(dataset, scope);
  }
  return {};
}

bool is_missing(const Dataset& dataset, int x, int y) {
  if (dataset.covered != nullptr) return !dataset.covered->touches({x, y, x + 1, y + 1});
  const int bx = x / dataset.block_columns, by = y / dataset.block_rows;
  return dataset
      .missing[static_cast<std::size_t>(by) * static_cast<std::size_t>(dataset.blocks_across) + static_cast<std::size_t>(bx)];
}

/// Blocks of a sparse file that do not exist are void, whatever an overview holds there; so are gaps of a VRT.
void mark_missing(const Dataset& dataset, Decimation& out) {
  if (!dataset.is_sparse()) return;
  if (out.mask.empty()) out.mask.assign(static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows), 255);
  for (int row = 0; row < out.rows; ++row) {
    const int y = line_at(row, out.rows, dataset.rows);
    for (int column = 0; column < out.columns; ++column) {
      const int x = line_at(column, out.columns, out.covered_columns);
      if (!is_missing(dataset, x, y)) continue;
      out.mask[static_cast<std::size_t>(row) * static_cast<std::size_t>(out.columns) + static_cast<std::size_t>(column)] = 0;
    }
  }
}

void copy_nodata(GDALRasterBand& from, GDALRasterBand& to) {
  int has = 0;
  if (from.GetRasterDataType() == GDT_Int64) {
    const auto value = from.GetNoDataValueAsInt64(&has);
    if (has != 0) to.SetNoDataValueAsInt64(value);
  } else if (from.GetRasterDataType() == GDT_UInt64) {
    const auto value = from.GetNoDataValueAsUInt64(&has);
    if (has != 0) to.SetNoDataValueAsUInt64(value);
  } else {
    const double value = from.GetNoDataValue(&has);
    if (has != 0) to.SetNoDataValue(value);
  }
}

CPLErr write_band(GDALRasterBand& band, const Decimation& pixels, const std::vector<std::uint8_t>& bytes, GDALDataType type) {
  return band.RasterIO(GF_Write, 0, 0, pixels.columns, pixels.rows, const_cast<std::uint8_t*>(bytes.data()), pixels.columns,
                       pixels.rows, type, 0, 0, nullptr);
}

}  // namespace

proto::Result<Decimation> decimated(const Dataset& dataset, int period, std::int64_t most_pixels) {
  const GdalScope scope(dataset.trust);
  Decimation out;
  out.covered_columns = period > 0 ? std::min(period, dataset.columns) : dataset.columns;
  const double step = std::sqrt(std::max(1.0, 1.0 * out.covered_columns * dataset.rows / static_cast<double>(most_pixels)));
  out.columns = std::max(1, static_cast<int>(out.covered_columns / step));
  out.rows = std::max(1, static_cast<int>(dataset.rows / step));
  const Image image = image_for(dataset, std::int64_t{out.columns} * out.rows);
  out.decoded_px = decoded_px(*image.band, out.columns, out.rows);
  if (out.decoded_px > kMostDecoded_px)
    return proto::Problem{"raster-too-large",
                          dataset.name + " has no overviews: too much of it would have to be decoded for a first picture",
                          "a raster with overviews", ""};
  const int width =
      std::max(1, static_cast<int>(std::lround(1.0 * out.covered_columns / dataset.columns * image.band->GetXSize())));
  const GDALDataType type = dataset.band->GetRasterDataType();
  const std::size_t count = static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows);
  out.values.resize(count * static_cast<std::size_t>(GDALGetDataTypeSizeBytes(type)));
  TextRows text;
  const auto band = image.band == dataset.band ? text.band(dataset, line_at(out.rows - 1, out.rows, dataset.rows) + 1)
                                               : proto::Result<GDALRasterBand*>(image.band);
  if (!band.ok()) return band.problem();
  if (auto read = read_rows(dataset, **band, width, out, type, out.values.data()); !read.ok()) return read.problem();
  if (image.mask != nullptr) {
    out.mask.resize(count);
    if (auto read = read_rows(dataset, *image.mask, width, out, GDT_Byte, out.mask.data()); !read.ok()) return read.problem();
  }
  mark_missing(dataset, out);
  return out;
}

proto::Result<void> put_decimation(Dataset& dataset, const std::shared_ptr<const Decimation>& shared) {
  const Decimation& pixels = *shared;
  const GdalScope scope(dataset.trust);
  const proto::Problem failed{"internal", "a thinned copy of " + dataset.name + " cannot be made", "", ""};
  GDALDriver* memory = GetGDALDriverManager()->GetDriverByName("MEM");
  if (memory == nullptr) return failed;
  const GDALDataType type = dataset.band->GetRasterDataType();
  GDALDatasetUniquePtr thin(memory->Create("", pixels.columns, pixels.rows, 0, type, nullptr));
  double place[6];
  if (!thin || dataset.handle->GetGeoTransform(place) != CE_None) return failed;
  char pointer[32] = {};
  CPLPrintPointer(pointer, const_cast<std::uint8_t*>(pixels.values.data()), sizeof pointer - 1);
  CPLStringList where;
  where.SetNameValue("DATAPOINTER", pointer);
  if (thin->AddBand(type, where.List()) != CE_None) return failed;
  const double across = 1.0 * pixels.covered_columns / pixels.columns, down = 1.0 * dataset.rows / pixels.rows;
  for (const int k : {1, 4}) place[k] *= across;
  for (const int k : {2, 5}) place[k] *= down;
  GDALRasterBand& from = *dataset.band;
  GDALRasterBand& to = *thin->GetRasterBand(1);
  thin->SetGeoTransform(place);
  if (const OGRSpatialReference* crs = dataset.handle->GetSpatialRef()) thin->SetSpatialRef(crs);
  to.SetUnitType(from.GetUnitType());
  to.SetScale(from.GetScale());
  to.SetOffset(from.GetOffset());
  copy_nodata(from, to);
  GDALRasterBand* mask = nullptr;
  if (!pixels.mask.empty()) {
    if (thin->CreateMaskBand(GMF_PER_DATASET) != CE_None || (mask = to.GetMaskBand()) == nullptr ||
        write_band(*mask, pixels, pixels.mask, GDT_Byte) != CE_None)
      return failed;
  }
  dataset.handle = std::move(thin);
  dataset.pixels = shared;
  dataset.band = dataset.handle->GetRasterBand(1);
  dataset.mask = mask;
  dataset.columns = pixels.columns;
  dataset.rows = pixels.rows;
  dataset.driver = "MEM";
  dataset.pixel_is_point = false;  // half a pixel of the raster itself is nothing here
  dataset.missing.clear();
  dataset.covered.reset();
  return {};
}

}  // namespace cordillera::raster
