#include "raster/open/text_rows.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "raster/disk/free_space.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/open/at_hand.h"
#include "raster/open/remote.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

Problem unwritable(const Dataset& dataset) {
  return {"storage-full", "no copy of " + dataset.name + " can be written to read it from", "a disk with free space", ""};
}

/// Copies rows up to the first that cannot be read, of which there may be none; their number.
proto::Result<int> copy_rows(const Dataset& dataset, GDALDataset& copy) {
  GDALRasterBand& to = *copy.GetRasterBand(1);
  const GDALDataType type = to.GetRasterDataType();
  std::vector<std::uint8_t> line(static_cast<std::size_t>(dataset.columns) *
                                 static_cast<std::size_t>(GDALGetDataTypeSizeBytes(type)));
  const auto move = [&](GDALRasterBand& band, GDALRWFlag way, int row) {
    const GdalScope scope(dataset.trust);
    return band.RasterIO(way, 0, row, dataset.columns, 1, line.data(), dataset.columns, 1, type, 0, 0, nullptr) == CE_None &&
           !scope.failed();
  };
  int row = 0;
  // In their order: asked for one behind a damaged line GDAL looks for all before it again, and for each of these again.
  for (; row < dataset.rows && move(*dataset.band, GF_Read, row); ++row)
    if (!move(to, GF_Write, row)) return unwritable(dataset);
  if (row < dataset.rows && is_remote(dataset.path)) {
    if (auto why = why_not_fetched(dataset.path, dataset.name, "")) return *why;
  }
  const GdalScope scope(dataset.trust);
  dataset.band->FlushCache(false);  // nobody reads these again
  copy.FlushCache(true);
  return scope.failed() ? proto::Result<int>(unwritable(dataset)) : row;
}

proto::Result<AtHand> make_copy(const Dataset& dataset) {
  const auto folder = std::make_shared<const PrivateFolder>();
  if (!folder->made()) return unwritable(dataset);
  AtHand made{folder->place("rows.tif"), dataset.name, "", folder};
  const GDALDataType type = dataset.band->GetRasterDataType();
  const auto bytes = static_cast<std::uint64_t>(dataset.columns) * static_cast<std::uint64_t>(dataset.rows) *
                     static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(type));
  if (auto full = no_room(made.path, bytes, "a copy of " + dataset.name)) return *full;
  const GdalScope scope(dataset.trust);
  GDALDriver* const tiff = GetGDALDriverManager()->GetDriverByName("GTiff");
  const char* const options[] = {"TILED=YES", "BIGTIFF=IF_SAFER", nullptr};
  const GDALDatasetUniquePtr copy(
      tiff == nullptr ? nullptr
                      : tiff->Create(made.path.c_str(), dataset.columns, dataset.rows, 1, type, const_cast<char**>(options)));
  if (!copy) return unwritable(dataset);
  const auto rows = copy_rows(dataset, *copy);
  if (!rows.ok()) return rows.problem();
  made.rows = *rows;
  return made;
}

}  // namespace

proto::Result<GDALRasterBand*> TextRows::band(const Dataset& dataset, int end) {
  if (dataset.driver != kTextGrid) return dataset.band;
  if (!copy_) {
    static constexpr const char* kTiff[] = {"GTiff", nullptr};
    auto made = shared_copy(dataset.key, [&dataset] { return make_copy(dataset); });
    if (!made.ok()) return made.problem();
    const GdalScope scope(dataset.trust);
    copy_.reset(GDALDataset::Open(made->path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, kTiff, nullptr, nullptr));
    if (!copy_)
      return Problem{"raster-unreadable",
                     dataset.name + " cannot be read from its copy: " + scope.message(made->path, dataset.name),
                     "a complete, undamaged file", ""};
    folder_ = std::move(made->folder);
    readable_ = made->rows;
  }
  if (end <= readable_) return copy_->GetRasterBand(1);
  return Problem{"raster-unreadable",
                 dataset.name + " is damaged: row " + std::to_string(readable_ + 1) + " of " + std::to_string(dataset.rows) +
                     " cannot be read as numbers",
                 "a complete, undamaged file", ""};
}

}  // namespace cordillera::raster
