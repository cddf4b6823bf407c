#pragma once
// Many rasters named at once: what a user may write where one raster could stand.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
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
///   a folder                    every raster in it and below it, in the order of their names; links are followed
///   *.txt, *.lst                a raster a line, and options after it: `fine.tif vertical_datum=EGM2008`; # starts a comment,
///                               a path with spaces stands in double quotes. A text of points (XYZ) is a raster
///   *.json                      {"sources": [{"path": …, option: value, …}, …]}, or a STAC item, ItemCollection or
///                               FeatureCollection: the asset with the role "data", else the first GeoTIFF that
///                               is no thumbnail, overview or metadata
///   *.gpkg, *.shp, *.geojson    a tile index, as gdaltindex makes it: field `location`
///   anything else               a raster: a file, a VRT, or what GDAL opens
/// A text and JSON may begin with a byte order mark. A file of this machine may stand there with escapes, as "old%20sheet.tif".
/// Paths in a list count from the list's folder; s3://, gs://, az:// and https:// become GDAL's /vsis3/, /vsigs/, /vsiaz/ and
/// /vsicurl/. Problems: "sources-invalid", naming the list and the line or member; "file-unreadable", naming what of a folder.
proto::Result<std::vector<ListedSource>> list_sources(const std::string& word);

/// Of a folder: how many texts that hold points it has, which are not taken with it, for a text may be anything; as a sentence
/// for people. Nothing where there are none, and of what is no folder.
std::optional<std::string> note_on_texts(const std::string& word);

/// What stands at an address in place of a raster: one of these lists, or a VRT, which is a raster and names others.
enum class ListKind : std::uint8_t { none, list, vrt };
/// By its name and its first bytes, a hundred or more. A list may still be a raster: points as text, elevation tiles of a
/// GeoPackage.
ListKind list_kind(std::string_view head, const std::string& name);

/// The rasters of a list that a stranger wrote, with paths as they stand in it: they count from where the list was. None: it is a
/// raster. name: what its user called it. Problems: "sources-invalid".
proto::Result<std::vector<ListedSource>> written_in(const std::string& path, const std::string& name);

}  // namespace cordillera::raster
