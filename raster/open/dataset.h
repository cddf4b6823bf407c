#pragma once
// An opened raster that passed the checks which need no pixel: driver, bands, type, size, blocks inside the file.
#include <gdal_priv.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "raster/disk/private_folder.h"
#include "raster/open/coverage.h"
#include "raster/source.h"

namespace cordillera::raster {

struct Decimation;
class GdalScope;

struct Dataset {
  std::shared_ptr<const PrivateFolder> folder;  ///< of an unpacked raster: its files, until the handle is closed
  std::shared_ptr<const Decimation> pixels;     ///< that it shows in place of a file's; until the handle is closed, too
  GDALDatasetUniquePtr handle;
  GDALRasterBand* band = nullptr;
  GDALRasterBand* mask = nullptr;  ///< mask or alpha band; null when validity is told by values alone
  std::string path;                ///< what GDAL opened
  std::string name;                ///< what the user called it, without folders
  std::string part;                ///< the variable or table that was chosen of several rasters in one file
  std::string driver;
  std::string key;  ///< what copies of it are kept by: the user's file, and its state
  Trust trust = Trust::operator_file;
  std::string colour;  ///< "red": of a band that was asked for, and is one of a picture's; empty: it is none
  int columns = 0, rows = 0;
  bool pixel_is_point = false;
  std::optional<double> asked_nodata;  ///< a raw value that is no height because the request says so
  bool signed_byte = false;            ///< GDAL before 3.7 has no Int8: Byte with a note

  /// Blocks of a TIFF that were never written (sparse); they are void. Empty when every block is stored.
  std::vector<bool> missing;  ///< indexed by block row * blocks_across + block column
  int block_columns = 0, block_rows = 0, blocks_across = 0;
  /// What the sources of a VRT without nodata values cover; the rest is void, too. Null when they cover all of it.
  std::shared_ptr<const Coverage> covered;

  bool is_sparse() const { return !missing.empty() || covered != nullptr; }
};

/// Opens a raster with one of the drivers we vouch for (formats.h), out of its archive if it is in one. band: the number or name
/// of its band, or the name of one of several rasters in the file; empty: the only one, or the only one that is called as heights
/// are.
/// before_copy: asked of points as text before they are copied to a grid, for a minute's work of a raster that is then refused.
proto::Result<Dataset> open_dataset(const std::string& path, const std::string& name, Trust trust, const std::string& band,
                                    const std::function<proto::Result<void>(const Dataset&)>& before_copy = {});

/// GDAL could not read pixels while the scope stood: "raster-unreadable", or why its storage does not give them (remote.h).
proto::Problem unreadable_pixels(const Dataset& dataset, const GdalScope& scope);

/// Of a file that holds several rasters, one: opens it in place of the file. Then of its bands one, with its mask.
proto::Result<void> choose_raster(Dataset& dataset, const std::string& asked);
proto::Result<void> choose_band(Dataset& dataset, const std::string& asked);

/// Whether a band, a variable or a column of points is called as heights are.
bool names_heights(const std::string& name);

/// Every block that the header promises must lie inside the file; notes the blocks of a sparse file that do not exist.
proto::Result<void> check_tiff_blocks(Dataset& dataset);

/// Notes what no source of a VRT covers, of a band with neither a nodata value nor a mask. Where sources leave out pixels by
/// nodata values of their own, the band is opened again with one. What a source itself never stored is 0, as GDAL reads it, and
/// so are gaps in a VRT that the VRT names.
void note_vrt_gaps(Dataset& dataset);

/// The first bytes of a file that is no raster usually tell what it is: a better message than "not recognised".
proto::Result<void> sniff(const std::string& path, const std::string& name, Trust trust);
/// "a NetCDF or HDF5 file": of a format that we read and that has a mark of its own; empty for others.
std::string signature(const std::string& path);
/// What a file that is text begins with, such as "404: Not Found", for people; empty where it is none.
std::string first_line_of_text(const std::string& path);

}  // namespace cordillera::raster
