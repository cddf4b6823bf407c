#pragma once
// A 3D Tiles face as one .3tz file: a ZIP of stored entries and an index by hash, so that a reader finds a tile without the
// directory. After the specification of 3TZ, version 1.3 (erikdahlstrom/3tz-specification).
#include <string>

#include "pipeline/exports/export_work.h"
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// Whether the face's entry is the tileset.json that the archive must have at its root.
bool fits_3tz(const faces::Face& face);

/// Every path of the face, under its own name. A ZIP has no way to store equal tiles once. Some 150 bytes of memory a path,
/// and four tiles a thread.
proto::Result<void> write_3tz(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                              Existing other = Existing::replace, const ExportWork& work = {});

}  // namespace cordillera::pipeline::exports
