#pragma once
// Whether a file has all the bytes that its header tells of, where the library that reads it may not miss them.
#include <string>

#include "proto/result.h"

namespace cordillera::raster {

struct Dataset;

/// "raster-truncated", before the file is opened: a GeoPackage that ends within its pages. A row may lie in them that scales its
/// heights, and whether it does depends on the version of GDAL that wrote it. Other files, and what is no local file, pass.
proto::Result<void> check_pages(const std::string& path, const std::string& name);

/// "raster-unreadable", before it is opened: a TIFF of thousands of directories, which GDAL reads for minutes.
proto::Result<void> check_directories(const std::string& path, const std::string& name);

/// The same as check_pages of an open one: NetCDF, and the bare rows of EHdr and ERS, beyond whose end GDAL 3.10 reads without a
/// word.
proto::Result<void> check_length(const Dataset& dataset);

}  // namespace cordillera::raster
