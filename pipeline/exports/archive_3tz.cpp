#include "pipeline/exports/archive_3tz.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include "pipeline/encode/little_endian.h"
#include "pipeline/exports/export_work.h"
#include "pipeline/exports/tile_places.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/exports/zip_writer.h"
#include "pipeline/faces/batches.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/tileset/manifest_json.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEntry = "tileset.json";
constexpr const char* kManifest = "manifest.json";
constexpr const char* kIndex = "@3dtilesIndex1@";  // must be the last entry

/// Hashes are ordered as two little-endian numbers, the first eight bytes first.
struct IndexEntry {
  std::array<std::uint64_t, 2> hash{};
  std::uint64_t offset = 0;
  friend auto operator<=>(const IndexEntry&, const IndexEntry&) = default;
};

std::string index_bytes(std::vector<IndexEntry> entries) {
  std::sort(entries.begin(), entries.end());
  std::string out;
  for (const IndexEntry& entry : entries) {
    for (const std::uint64_t number : {entry.hash[0], entry.hash[1], entry.offset}) append_little_endian(out, number);
  }
  return out;
}

struct Entry {
  std::string path;
  const faces::Resource* resource = nullptr;
  faces::Place place;
  faces::Document document;
};

void write(const faces::Terrain& terrain, const faces::Face& face, const ExportWork& work, const fs::path& sibling) {
  ExportProgress progress(work.progress);
  std::ofstream out = opened(sibling);
  ZipWriter zip(out);
  std::vector<IndexEntry> entries;
  const auto add = [&](const std::string& path, std::string_view bytes) {
    const std::uint64_t offset = zip.add(path, bytes);
    const std::string hash = md5(path);
    entries.push_back({{little_endian_at<std::uint64_t>(hash, 0), little_endian_at<std::uint64_t>(hash, 8)}, offset});
  };
  faces::Batches<Entry> documents(
      work.threads, [&](Entry& entry) { entry.document = made(terrain, *entry.resource, entry.place); },
      [&](Entry& entry) {
        add(entry.path, entry.document.bytes);
        progress.next();
      });
  progress.expect(terrain, [&](const auto& one) {
    each_named(terrain, face, {1, faces::Named::expected}, [&](const std::string&, const faces::Found&) { one(); });
  });
  each_named(terrain, face, work.threads, [&](const std::string& path, const faces::Found& found) {
    documents.add({path, found.resource, found.place, {}});
  });
  documents.finish();
  progress.finish();
  // No client of 3D Tiles asks for it: it says what the tiles were made of, as in a folder.
  add(kManifest, manifest_json(terrain.manifest()));
  zip.add(kIndex, index_bytes(std::move(entries)));
  zip.finish();
  out.close();
}

}  // namespace

bool fits_3tz(const faces::Face& face) { return face.entry == kEntry; }

proto::Result<void> write_3tz(const faces::Terrain& terrain, const faces::Face& face, const std::string& path, Existing other,
                              const ExportWork& work) {
  return write_export(path, other, [&](const fs::path& sibling) { write(terrain, face, work, sibling); });
}

}  // namespace cordillera::pipeline::exports
