#pragma once
// A face's tiles as one PMTiles archive, version 3: any web server with byte ranges, or a bucket, serves it.
#include <string>

#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// Whether the face has tiles that such an archive can hold.
bool fits_pmtiles(const faces::Face& face);

/// Clustered: the bytes lie in the order of the directories; equal tiles are stored once. Some 100 bytes of memory a tile. A face
/// that does not fit is a programmer's mistake.
proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  Existing other = Existing::replace);

}  // namespace cordillera::pipeline::exports
