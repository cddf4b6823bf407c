#pragma once
// A face's tiles as one PMTiles archive, version 3: any web server with byte ranges, or a bucket, serves it.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "pipeline/exports/export_work.h"
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// Whether the face has tiles that such an archive can hold.
bool fits_pmtiles(const faces::Face& face);

/// What whoever has an archive made lets it take.
struct ArchiveBounds {
  /// Asked before each of its tiles is made, with how many these are by then; a problem ends it.
  std::function<std::optional<proto::Problem>(std::uint64_t tiles)> tiles;
  /// Asked before so many more bytes go to the disk, which holds it twice for a while; a problem ends it.
  std::function<std::optional<proto::Problem>(std::uint64_t more)> bytes;
};

/// Clustered: the bytes lie in the order of the directories; equal tiles are stored once. Some 150 bytes of memory a tile, and
/// four tiles a thread. A face that does not fit is a programmer's mistake.
proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  Existing other = Existing::replace, const ExportWork& work = {});
/// By the caller's thread alone.
proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  const ArchiveBounds& bounds);

}  // namespace cordillera::pipeline::exports
