#pragma once
// An opened raster that passed the checks which need no pixel: driver, bands, type, size, blocks inside the file.
#include <gdal_priv.h>

#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "raster/source.h"

namespace cordillera::raster {

struct Dataset {
  GDALDatasetUniquePtr handle;
  GDALRasterBand* band = nullptr;
  GDALRasterBand* mask = nullptr;  ///< mask or alpha band; null when validity is told by values alone
  std::string path;                ///< what GDAL opened
  std::string name;                ///< what the user called it, without folders
  std::string driver;
  Trust trust = Trust::operator_file;
  int columns = 0, rows = 0;
  bool pixel_is_point = false;
  std::optional<double> asked_nodata;  ///< a raw value that is no height because the request says so
  bool signed_byte = false;        ///< GDAL before 3.7 has no Int8: Byte with a note

  /// Blocks of a TIFF that were never written (sparse); they are void. Empty when every block is stored.
  std::vector<bool> missing;       ///< indexed by block row * blocks_across + block column
  int block_columns = 0, block_rows = 0, blocks_across = 0;
};

/// Opens a single-band raster with one of the drivers we vouch for.
proto::Result<Dataset> open_dataset(const std::string& path, const std::string& name, Trust trust);

/// Every block that the header promises must lie inside the file; notes the blocks of a sparse file that do not exist.
proto::Result<void> check_tiff_blocks(Dataset& dataset);

/// The first bytes of a file that is no raster usually tell what it is: a better message than "not recognised".
/// Type and detail for what the file is; empty detail when nothing speaks against trying.
proto::Result<void> sniff(const std::string& path, const std::string& name, Trust trust);

inline constexpr const char* kAcceptedFormats =
    "a single-band GeoTIFF or COG, an .hgt named like N44W072.hgt, an Esri ASCII grid or a USGS DEM";

}  // namespace cordillera::raster
