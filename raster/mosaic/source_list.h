#pragma once
// Many rasters named at once: what a user may write where one raster could stand.
#include <string>
#include <utility>
#include <vector>

#include "proto/result.h"

namespace cordillera::raster {

/// A raster and the options that its list gives to it alone, as they were written.
struct ListedSource {
  std::string path;
  std::vector<std::pair<std::string, std::string>> options;
};

/// word, by what it is:
///   a folder                    every raster in it and below it, in the order of their names
///   *.txt, *.lst                a raster a line, and options after it: `fine.tif vertical_datum=EGM2008`; # starts a comment, a
///   path with
///                               spaces stands in double quotes. A text of points (XYZ) is a raster
///   *.json                      {"sources": [{"path": …, option: value, …}, …]}, or a STAC item, ItemCollection or
///   FeatureCollection:
///                               the asset with the role "data", else the first GeoTIFF
///   *.gpkg, *.shp, *.geojson    a tile index, as gdaltindex makes it: field `location`
///   anything else               a raster: a file, a VRT, or what GDAL opens
/// Paths in a list count from the list's folder; s3://, gs://, az:// and https:// become GDAL's /vsis3/, /vsigs/, /vsiaz/ and
/// /vsicurl/. Problems: "sources-invalid", naming the list and the line or member.
proto::Result<std::vector<ListedSource>> list_sources(const std::string& word);

}  // namespace cordillera::raster
