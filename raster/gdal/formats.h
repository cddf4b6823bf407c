#pragma once
// The formats that we vouch for, and no others: GDAL reads some two hundred, several of which can name other files, URLs or
// commands.
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "raster/source.h"

namespace cordillera::raster {

/// Who may bring it.
enum class From {
  anybody,   ///< as one file, posted too
  together,  ///< it needs files beside it: posted, all of them come in one zip
  operators  ///< from the command line alone: it names files of the machine
};

struct Format {
  const char* driver;      ///< as GDAL has it
  const char* reads;       ///< which files, for people
  const char* extensions;  ///< of its rasters, a blank after each: ".tif .tiff "
  From from;
};

std::span<const Format> formats();

/// ".tif" of "DEM.TIF".
std::string extension_of(const std::string& name);
/// Whether rasters have this extension; VRTs are none of their own.
bool is_raster_extension(std::string_view extension);
/// What a raster's side files have: the header that places it, its CRS, the world file.
bool is_side_extension(std::string_view extension);
/// Whether a file of this name says something of the raster of that name and is none itself: of "dem.tif" those are "dem.tfw",
/// "dem.prj", "dem.tif.aux.xml" and such, and of an ER Mapper header "dem.ers" the heights, "dem".
bool is_side_of(const std::string& raster, const std::string& other);
/// Names of files that is_side_of() takes for sides of the raster of this path, notes left out, in small and in capital letters.
std::vector<std::string> sides_of(const std::string& raster);
/// "dem.tif.aux.xml": GDAL's and Esri's notes on a raster. They can name other files, so an unpacked one lies where no driver
/// looks for it.
bool is_pam(const std::string& name);
/// "dem.tif.msk": which pixels of a raster are valid, as GDAL writes it.
bool is_mask(const std::string& name);
/// The one that GDAL reads with the raster of this path.
std::string pam_of(const std::string& raster);
std::string pam_of_unpacked(const std::string& raster);
/// The format whose rasters need files beside them and have this extension; null: there is none.
const Format* needs_others(std::string_view extension);
/// ".hdr" of ".bil": what the header has that lies beside such a raster; empty where there is none, or, of ".ers", is the raster.
std::string header_of(std::string_view extension);
/// All of is_raster_extension, for people.
std::string raster_extensions();

/// Of a file of that name, for GDAL's Open, null last. in_archive: what lies beside the raster came with it.
std::vector<const char*> allowed_drivers(const std::string& name, Trust trust, bool in_archive);

/// From here on, in this process, GDAL has these drivers, VRT and its memory, and no others: what a VRT names is opened with any
/// that there are.
void keep_drivers_of_anybody();

/// What is read, and with a name the line that makes a GeoTIFF of such a file, if GDAL can.
std::string accepted_formats(const std::string& name);
/// A file's name as a shell reads it.
std::string shell_word(const std::string& name);
/// The line that makes a GeoTIFF of the file beside it: "gdalwarp dem.tif dem-2.tif" of "gdalwarp".
std::string copying_line(const std::string& command, const std::string& name);
/// The line that makes a copy with another CRS.
std::string correcting_line(const std::string& name, const std::string& crs = "EPSG:CODE");

}  // namespace cordillera::raster
