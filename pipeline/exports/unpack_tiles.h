#pragma once
// An archive of tiles for maps as a folder of finished tiles, which a service can mount.
#include <atomic>
#include <cstdint>
#include <map>
#include <string>

#include "proto/result.h"

namespace cordillera::pipeline::exports {

/// A PMTiles archive, or an MBTiles file by its name's ending or its mark.
bool is_tile_archive(const std::string& path);

/// What an archive says of itself, and how many tiles it has. Texts are empty where it does not say.
struct ArchiveWords {
  std::string kind;                       ///< "PMTiles" or "MBTiles"
  std::string name, attribution, bounds;  ///< bounds: "west,south,east,north", degrees
  std::string format, encoding;           ///< of the tiles: "png", "pbf"; of heights in pixels: "mapbox", "terrarium"
  std::string face;                       ///< the name of the format that this program wrote
  std::map<int, std::uint64_t> tiles;     ///< by zoom
};
/// Reads no tile. Problems: "archive-unreadable", "archive-too-large" of a directory with more than a million tiles.
proto::Result<ArchiveWords> describe_archive(const std::string& path);

/// Into an empty folder: the tiles as `build` writes those of a format of Web Mercator, the format's TileJSON, and a manifest.
/// Others' archives are taken for Terrain-RGB or Terrarium where they say so ("encoding") or their pixels can be no picture, for
/// contours where they have that layer, else for pictures; of their manifest only name, attribution and bounds are known.
/// stop: asked once a tile, and within a row that a view computes; may be null.
/// Problems: "cancelled", "archive-unreadable", "archive-too-large" (more than a million tiles), "storage-full";
/// "file-unreadable": meshes, or lines of something else.
proto::Result<void> unpack_tiles(const std::string& path, const std::string& folder, const std::atomic<bool>* stop = nullptr);

}  // namespace cordillera::pipeline::exports
