#include "raster/gdal/formats.h"

#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <sstream>

#include "proto/letters.h"
#include "proto/utf8.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

constexpr std::array kFormats{
    Format{"GTiff", "GeoTIFF and COG", ".tif .tiff ", From::anybody},
    Format{"SRTMHGT", ".hgt", ".hgt ", From::anybody},
    Format{"AAIGrid", "Esri ASCII grid", ".asc ", From::anybody},
    Format{"USGSDEM", "USGS DEM", ".dem ", From::anybody},
    Format{"netCDF", "NetCDF", ".nc .grd ", From::anybody},
    Format{"HFA", "Erdas Imagine .img", ".img ", From::anybody},
    Format{"DTED", "DTED", ".dt0 .dt1 .dt2 ", From::anybody},
    Format{"XYZ", "XYZ", ".xyz ", From::anybody},
    Format{"GPKG", "GeoPackage", ".gpkg ", From::anybody},
    Format{"JP2OpenJPEG", "JPEG 2000", ".jp2 ", From::anybody},
    Format{"EHdr", "Esri .bil and .flt", ".bil .flt ", From::together},
    Format{"ERS", "ER Mapper", ".ers ", From::together},
    Format{"SAGA", "SAGA grid", ".sdat ", From::together},
    Format{"VRT", "VRT, on the command line alone", "", From::operators},
};

constexpr std::string_view kSides = ".hdr .prj .sgrd .tfw .tifw .wld .j2w .ige ";
constexpr std::string_view kPam = ".aux.xml", kMask = ".msk";

/// What the driver of Esri's raw files opens has any name: whatever has a .hdr beside it, which may be the header of another
/// file.
constexpr std::string_view kRawDriver = "EHdr", kRaw = ".bil .flt .bip .bsq .dem ";

bool holds(std::string_view extensions, std::string_view extension) {
  return !extension.empty() && extensions.find(std::string(extension) + " ") != extensions.npos;
}

}  // namespace

std::span<const Format> formats() { return kFormats; }

std::string extension_of(const std::string& name) { return proto::lower(std::filesystem::path(name).extension().string()); }

bool is_raster_extension(std::string_view extension) {
  return std::any_of(kFormats.begin(), kFormats.end(), [&](const Format& format) { return holds(format.extensions, extension); });
}

bool is_side_extension(std::string_view extension) { return holds(kSides, extension) || extension == kMask; }

bool is_pam(const std::string& name) { return proto::lower(name).ends_with(kPam); }

bool is_mask(const std::string& name) { return proto::lower(name).ends_with(kMask); }

std::string pam_of(const std::string& raster) { return raster + std::string(kPam); }

std::string pam_of_unpacked(const std::string& raster) { return raster + ".notes"; }

bool is_side_of(const std::string& raster, const std::string& other) {
  const std::string name = proto::lower(other), of = proto::lower(raster);
  const auto stem = [](const std::string& file) { return std::filesystem::path(file).stem().string(); };
  if (name == pam_of(of) || name == pam_of(stem(of)) || name == of + std::string(kMask)) return true;
  if (name == of || stem(name) != stem(of)) return false;
  return holds(kSides, extension_of(name)) || (extension_of(name).empty() && extension_of(of) == ".ers");
}

std::vector<std::string> sides_of(const std::string& raster) {
  std::vector<std::string> sides;
  std::istringstream extensions{std::string(kSides)};
  for (std::string small; extensions >> small;) {
    std::string capital = small;
    std::transform(capital.begin(), capital.end(), capital.begin(), [](unsigned char c) { return std::toupper(c); });
    for (const std::string& extension : {small, capital})
      sides.push_back(std::filesystem::path(raster).replace_extension(extension).string());
  }
  if (extension_of(raster) == ".ers") sides.push_back(std::filesystem::path(raster).replace_extension().string());
  return sides;
}

const Format* needs_others(std::string_view extension) {
  const auto found = std::find_if(kFormats.begin(), kFormats.end(),
                                  [&](const Format& f) { return f.from == From::together && holds(f.extensions, extension); });
  return found == kFormats.end() ? nullptr : found;
}

std::string header_of(std::string_view extension) {
  if (needs_others(extension) == nullptr || extension == ".ers") return "";
  return extension == ".sdat" ? ".sgrd" : ".hdr";
}

std::string raster_extensions() {
  std::string all;
  for (const Format& format : kFormats) all += format.extensions;
  all.pop_back();
  return all;
}

std::vector<const char*> allowed_drivers(const std::string& name, Trust trust, bool in_archive) {
  std::vector<const char*> allowed;
  for (const Format& format : kFormats) {
    const bool welcome =
        trust == Trust::operator_file || format.from == From::anybody || (format.from == From::together && in_archive);
    const std::string_view driver = format.driver;
    if (driver == "SRTMHGT" || (driver == kRawDriver && !holds(kRaw, extension_of(name))))
      continue;  // the former is asked for by its name alone
    if (welcome) allowed.push_back(format.driver);
  }
  allowed.push_back(nullptr);
  return allowed;
}

void keep_drivers_of_anybody() {
  const GdalScope scope(Trust::posted_file);  // after which they are all there
  GDALDriverManager& all = *GetGDALDriverManager();
  for (int k = all.GetDriverCount(); k-- > 0;) {
    GDALDriver* const driver = all.GetDriver(k);
    const std::string_view name = driver->GetDescription();
    const bool stays = name == "VRT" || name == "MEM" || std::any_of(kFormats.begin(), kFormats.end(), [&](const Format& format) {
                         return format.from == From::anybody && name == format.driver;
                       });
    if (!stays) all.DeregisterDriver(driver);
  }
}

std::string shell_word(const std::string& name) {
  const auto plain = [](char c) { return proto::is_letter_or_digit(c, ".-_:"); };
  if (!name.empty() && name[0] != '-' && std::all_of(name.begin(), name.end(), plain)) return name;
  std::string word = "'";
  for (const char c : proto::shown_text(name)) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

/// Of what lies in an archive, its own name: "dem.zip/a.png" is to be unpacked first.
static std::string unpacked_name(const std::string& name) {
  const std::string small = proto::lower(name);
  const bool in_archive = small.find(".zip/") != small.npos || small.find(".gz/") != small.npos;
  return in_archive ? name.substr(name.rfind('/') + 1) : name;
}

std::string copying_line(const std::string& command, const std::string& name) {
  const std::string tiff = std::filesystem::path(name).stem().string() + (extension_of(name) == ".tif" ? "-2.tif" : ".tif");
  return command + " " + shell_word(unpacked_name(name)) + " " + shell_word(tiff);
}

std::string correcting_line(const std::string& name, const std::string& crs) {
  return copying_line("gdal_translate -a_srs " + shell_word(crs), name);
}

std::string accepted_formats(const std::string& name) {
  const std::string accepted =
      "GeoTIFF or COG, an .hgt named like N44W072.hgt, Esri ASCII grid, USGS DEM, NetCDF, Erdas .img, DTED, XYZ, GeoPackage, "
      "JPEG 2000; Esri .bil or .flt, "
      "ER Mapper, SAGA with their headers in a .zip; any of them in a .zip or .gz";
  if (name.empty()) return accepted;
  return accepted + ". If GDAL reads it, this makes a GeoTIFF: " + copying_line("gdal_translate", name);
}

}  // namespace cordillera::raster
