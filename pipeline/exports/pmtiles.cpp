#include "pipeline/exports/pmtiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <unordered_map>

#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/gzip.h"
#include "pipeline/exports/hilbert.h"
#include "pipeline/exports/pmtiles_directory.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/batches.h"
#include "pipeline/store/content_hash.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;
using faces::Resource;

constexpr std::uint8_t kNone = 1, kGzip = 2;  // as the header numbers compressions

/// Formats that are compressed themselves gain nothing.
std::uint8_t compression_of(const Resource& tiles) {
  return tiles.compression == faces::Compression::gzip || tiles.type == faces::kVectorTile ? kGzip : kNone;
}

std::uint8_t type_of(const Resource& tiles) {
  if (tiles.type == faces::kVectorTile) return 1;
  if (tiles.type == "image/png") return 2;
  if (tiles.type == "image/jpeg") return 3;
  return tiles.type == "image/webp" ? 4 : 0;
}

struct HashOfHash {
  std::size_t operator()(const std::string& hash) const {
    std::size_t value = 0;
    std::memcpy(&value, hash.data(), sizeof value);
    return value;
  }
};

struct Contents {
  std::vector<PmtilesEntry> entries;
  std::uint64_t tiles = 0, contents = 0, bytes = 0;
  int least_zoom = 0, most_zoom = 0;
};

std::vector<std::uint64_t> ids_of(const faces::Terrain& terrain, const faces::Face& face, const Resource& tiles,
                                  unsigned threads) {
  std::vector<std::uint64_t> ids;
  each_place(terrain, face, tiles, threads,
             [&](const faces::Place& place) { ids.push_back(hilbert_id(square_address(tiles.grid, place))); });
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void ask(const std::function<std::optional<proto::Problem>(std::uint64_t)>& bound, std::uint64_t count) {
  auto refused = bound ? bound(count) : std::nullopt;
  if (refused) throw Refused{std::move(*refused)};
}

struct ArchivedTile {
  std::uint64_t id = 0;
  std::string hash, bytes;  ///< bytes: empty where an earlier batch had them
};

/// Every content once, in the order of ids.
Contents write_tiles(const faces::Terrain& terrain, const Resource& tiles, const std::vector<std::uint64_t>& ids,
                     const ArchiveBounds& bounds, unsigned threads, std::ostream& out) {
  Contents all;
  std::unordered_map<std::string, PmtilesEntry, HashOfHash> known;
  faces::Batches<ArchivedTile> waiting(
      threads,
      [&](ArchivedTile& tile) {
        const faces::Document document = made(terrain, tiles, place_at(tiles.grid, hilbert_address(tile.id)));
        tile.hash = content_hash(document.bytes);
        if (known.contains(tile.hash)) return;
        tile.bytes = compression_of(tiles) == kGzip ? gzip(document.bytes) : std::string(document.bytes);
      },
      [&](ArchivedTile& tile) {
        const auto [found, fresh] = known.try_emplace(tile.hash);
        if (fresh) {
          found->second = {tile.id, all.bytes, static_cast<std::uint32_t>(tile.bytes.size()), 1};
          all.bytes += tile.bytes.size();
          ask(bounds.bytes, tile.bytes.size());
          append(out, tile.bytes);
        }
        append(all.entries, {tile.id, found->second.offset, found->second.length, 1});
      });
  for (const std::uint64_t id : ids) waiting.add({id, {}, {}});
  waiting.finish();
  all.tiles = ids.size();
  all.contents = known.size();
  if (ids.empty()) return all;
  all.least_zoom = hilbert_address(ids.front()).zoom;
  all.most_zoom = hilbert_address(ids.back()).zoom;
  return all;
}

/// Degrees in steps of 1e-7.
void append_degrees(std::string& out, double degrees) {
  append_little_endian(out, static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(degrees * 1e7))));
}

std::string header(const Resource& tiles, const Contents& all, const PmtilesDirectories& directories, std::size_t metadata,
                   const proto::Manifest& manifest) {
  const Extent extent = extent_of(manifest, tiles.grid);
  const View view = view_of(manifest, tiles.grid, all.least_zoom, all.most_zoom);
  std::string out = "PMTiles\3";
  std::uint64_t offset = kPmtilesHeader;
  for (const std::uint64_t size :
       {std::uint64_t{directories.root.size()}, std::uint64_t{metadata}, std::uint64_t{directories.leaves.size()}, all.bytes}) {
    append_little_endian(out, offset);
    append_little_endian(out, size);
    offset += size;
  }
  for (const std::uint64_t count : {all.tiles, std::uint64_t{all.entries.size()}, all.contents}) append_little_endian(out, count);
  for (const int byte : {1, int{kGzip}, int{compression_of(tiles)}, int{type_of(tiles)}, all.least_zoom, all.most_zoom}) {
    out.push_back(static_cast<char>(byte));
  }
  for (const double degrees : {extent.west, extent.south, extent.east, extent.north}) append_degrees(out, degrees);
  out.push_back(static_cast<char>(view.zoom));
  for (const double degrees : {view.longitude_deg, view.latitude_deg}) append_degrees(out, degrees);
  return out;
}

/// The directories stand before the tiles and are known after them: the tiles wait in a file of their own.
void write(const faces::Terrain& terrain, const faces::Face& face, const ArchiveBounds& bounds, unsigned threads,
           const fs::path& sibling) {
  const Resource& tiles = *tiles_of(face);
  const TemporaryFile spool(sibling.string() + ".tiles");
  std::ofstream waiting = opened(spool.path());
  const auto ids = ids_of(terrain, face, tiles, threads);
  ask(bounds.tiles, ids.size());
  const Contents all = write_tiles(terrain, tiles, ids, bounds, threads, waiting);
  waiting.close();
  ask(bounds.bytes, all.bytes);
  const PmtilesDirectories directories = pmtiles_directories(all.entries);
  const std::string metadata = gzip(archive_metadata(terrain, face, all.least_zoom, all.most_zoom));
  std::ofstream out = opened(sibling);
  append(out, header(tiles, all, directories, metadata.size(), terrain.manifest()));
  for (const std::string* part : {&directories.root, &metadata, &directories.leaves}) append(out, *part);
  if (all.bytes > 0) out << opened_to_read(spool.path()).rdbuf();
  out.close();
}

}  // namespace

bool fits_pmtiles(const faces::Face& face) { return tiles_of(face) != nullptr; }

proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path, Existing other,
                                  unsigned threads) {
  return write_export(path, other, [&](const fs::path& sibling) { write(terrain, face, {}, threads, sibling); });
}

proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  const ArchiveBounds& bounds) {
  return write_export(path, Existing::replace, [&](const fs::path& sibling) { write(terrain, face, bounds, 1, sibling); });
}

}  // namespace cordillera::pipeline::exports
