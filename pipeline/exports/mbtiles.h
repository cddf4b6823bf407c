#pragma once
// A face's pictures or vector tiles as one MBTiles file, version 1.3: a SQLite database that map programs and tile servers open.
#include <string>

#include "pipeline/exports/export_work.h"
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// Whether the face's tiles are pictures or vector tiles in Web Mercator: nothing else has a place in such a file.
bool fits_mbtiles(const faces::Face& face);

/// Rows count from the south there. Equal tiles are stored once: tiles is a view. Memory does not grow with the dataset:
/// each thread makes four tiles at a time.
proto::Result<void> write_mbtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  Existing other = Existing::replace, const ExportWork& work = {});

}  // namespace cordillera::pipeline::exports
