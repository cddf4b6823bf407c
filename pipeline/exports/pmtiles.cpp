#include "pipeline/exports/pmtiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/export_work.h"
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

void ask(const std::function<std::optional<proto::Problem>(std::uint64_t)>& bound, std::uint64_t count) {
  auto refused = bound ? bound(count) : std::nullopt;
  if (refused) throw Refused{std::move(*refused)};
}

/// What an archive is made with.
struct Making {
  const ArchiveBounds& bounds;
  const ExportWork& work;
};

/// The bytes of some tiles, where they wait.
struct Content {
  std::uint64_t offset = 0;
  std::uint32_t length = 0;
};
struct WaitingTile {
  std::uint64_t id = 0;
  std::size_t content = 0;
};
struct Waiting {
  std::vector<WaitingTile> tiles;  ///< by id
  std::vector<Content> contents;   ///< as they came
};

struct DrawnTile {
  std::uint64_t id = 0;
  std::string hash, bytes;  ///< bytes: empty where an earlier batch had them
};

/// Every tile is drawn as it is listed, once: to tell whether it shows anything is most of the work. Every content once, too.
Waiting write_as_they_come(const faces::Terrain& terrain, const faces::Face& face, const Resource& tiles, const Making& making,
                           std::ostream& out) {
  ExportProgress progress(making.work.progress);
  Waiting all;
  std::uint64_t bytes = 0;
  std::unordered_map<std::string, std::size_t, HashOfHash> known;
  std::unordered_set<std::uint64_t> listed;
  faces::Batches<DrawnTile> drawn(
      making.work.threads,
      [&](DrawnTile& tile) {
        const faces::Document document = made(terrain, tiles, place_at(tiles.grid, hilbert_address(tile.id)));
        tile.hash = content_hash(document.bytes);
        if (known.contains(tile.hash)) return;
        tile.bytes = compression_of(tiles) == kGzip ? gzip(document.bytes) : std::string(document.bytes);
      },
      [&](DrawnTile& tile) {
        const auto [found, fresh] = known.try_emplace(tile.hash, all.contents.size());
        if (fresh) {
          ask(making.bounds.bytes, tile.bytes.size());
          all.contents.push_back({bytes, static_cast<std::uint32_t>(tile.bytes.size())});
          bytes += tile.bytes.size();
          append(out, tile.bytes);
        }
        all.tiles.push_back({tile.id, found->second});
        progress.next();
      });
  progress.expect(terrain, [&](const auto& one) {
    each_place(terrain, face, tiles, {1, faces::Named::expected}, [&](const faces::Place&) { one(); });
  });
  each_place(terrain, face, tiles, making.work.threads, [&](const faces::Place& place) {
    const std::uint64_t id = hilbert_id(square_address(tiles.grid, place));
    if (!listed.insert(id).second) return;
    ask(making.bounds.tiles, listed.size());
    drawn.add({id, {}, {}});
  });
  drawn.finish();
  progress.finish();
  std::ranges::sort(all.tiles, {}, &WaitingTile::id);
  return all;
}

/// What the archive holds, in the order of ids.
struct Contents {
  std::vector<PmtilesEntry> entries;
  std::vector<Content> order;  ///< of contents, where they wait
  std::uint64_t tiles = 0, bytes = 0;
  int least_zoom = 0, most_zoom = 0;
};

Contents in_order(const Waiting& waiting) {
  Contents all;
  std::vector<std::optional<std::uint64_t>> offset(waiting.contents.size());
  for (const WaitingTile& tile : waiting.tiles) {
    const Content& content = waiting.contents[tile.content];
    if (!offset[tile.content]) {
      offset[tile.content] = all.bytes;
      all.bytes += content.length;
      all.order.push_back(content);
    }
    append(all.entries, {tile.id, *offset[tile.content], content.length, 1});
  }
  all.tiles = waiting.tiles.size();
  if (waiting.tiles.empty()) return all;
  all.least_zoom = hilbert_address(waiting.tiles.front().id).zoom;
  all.most_zoom = hilbert_address(waiting.tiles.back().id).zoom;
  return all;
}

void copy(const std::vector<Content>& contents, std::istream& from, std::ostream& out) {
  std::string bytes;
  for (const Content& content : contents) {
    bytes.resize(content.length);
    from.seekg(static_cast<std::streamoff>(content.offset));
    from.read(bytes.data(), content.length);
    append(out, bytes);
  }
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
  for (const std::uint64_t count : {all.tiles, std::uint64_t{all.entries.size()}, std::uint64_t{all.order.size()}})
    append_little_endian(out, count);
  for (const int byte : {1, int{kGzip}, int{compression_of(tiles)}, int{type_of(tiles)}, all.least_zoom, all.most_zoom}) {
    out.push_back(static_cast<char>(byte));
  }
  for (const double degrees : {extent.west, extent.south, extent.east, extent.north}) append_degrees(out, degrees);
  out.push_back(static_cast<char>(view.zoom));
  for (const double degrees : {view.longitude_deg, view.latitude_deg}) append_degrees(out, degrees);
  return out;
}

/// The directories stand before the tiles and are known after them: the tiles wait in a file of their own, as they come.
void write(const faces::Terrain& terrain, const faces::Face& face, const Making& making, const fs::path& sibling) {
  const Resource& tiles = *tiles_of(face);
  const TemporaryFile spool(sibling.string() + ".tiles");
  std::ofstream waiting = opened(spool.path());
  const Contents all = in_order(write_as_they_come(terrain, face, tiles, making, waiting));
  waiting.close();
  ask(making.bounds.bytes, all.bytes);
  const PmtilesDirectories directories = pmtiles_directories(all.entries);
  const std::string metadata = gzip(archive_metadata(terrain, face, all.least_zoom, all.most_zoom));
  std::ofstream out = opened(sibling);
  append(out, header(tiles, all, directories, metadata.size(), terrain.manifest()));
  for (const std::string* part : {&directories.root, &metadata, &directories.leaves}) append(out, *part);
  std::ifstream drawn = opened_to_read(spool.path());
  copy(all.order, drawn, out);
  out.close();
}

}  // namespace

bool fits_pmtiles(const faces::Face& face) { return tiles_of(face) != nullptr; }

proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path, Existing other,
                                  const ExportWork& work) {
  return write_export(path, other, [&](const fs::path& sibling) { write(terrain, face, {ArchiveBounds{}, work}, sibling); });
}

proto::Result<void> write_pmtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path,
                                  const ArchiveBounds& bounds) {
  return write_export(path, Existing::replace, [&](const fs::path& sibling) {
    write(terrain, face, {bounds, ExportWork{}}, sibling);
  });
}

}  // namespace cordillera::pipeline::exports
