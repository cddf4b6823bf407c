#pragma once
// Files as people send them: archives made by GDAL, and what is compared with what.
#include <string>
#include <utility>
#include <vector>

#include "fixture.h"

namespace cordillera::raster_test {

/// Into a new zip at path: name in the zip, file that is packed.
void zip_files(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files);
/// The same of bytes.
void zip_bytes(const std::string& path, const std::vector<std::pair<std::string, std::string>>& files);
void gzip_file(const std::string& path, const std::string& file);
std::string bytes_of(const std::string& file);

/// Hills of 61 x 47 pixels at 10 E, 45 N, whole metres: no format rounds them.
Spec hills();

/// A format, and what it is written with.
struct SentRow {
  const char* name;
  const char* driver;
  const char* file;
  std::vector<std::string> create;
  const char* type = "Int16";
  std::vector<std::string> beside = {};  ///< files that it needs; posted: all in a zip
  bool says_crs = true;
  bool says_nodata() const;  ///< XYZ and JPEG 2000 have no word for it
};
std::vector<SentRow> sent_rows();
/// What is sent of a raster written to file: names and files. What GDAL notes beside it is no part of it, and is removed.
std::vector<std::pair<std::string, std::string>> files_of(const SentRow& row, const std::string& file);

/// Both say the same height everywhere, to a centimetre: formats write places with nine digits or more.
void expect_same_heights(raster::Source& a, raster::Source& b);

}  // namespace cordillera::raster_test
