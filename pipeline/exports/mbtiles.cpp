#include "pipeline/exports/mbtiles.h"

#include <algorithm>
#include <optional>

#include "pipeline/encode/json.h"
#include "pipeline/exports/archive_metadata.h"
#include "pipeline/exports/export_work.h"
#include "pipeline/exports/gzip.h"
#include "pipeline/exports/tile_places.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/batches.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/tileset/html_text.h"

namespace cordillera::pipeline::exports {
namespace {

namespace fs = std::filesystem;

// The file is thrown away if anything fails, so its journal needs no file, which a full disk would leave beside it; SQLite keeps
// one where databases are defended. 1297105496 is "MPBX".
constexpr const char* kTables = R"(
PRAGMA journal_mode = MEMORY;
PRAGMA synchronous = OFF;
PRAGMA application_id = 1297105496;
CREATE TABLE metadata(name TEXT, value TEXT);
CREATE TABLE map(zoom_level INTEGER, tile_column INTEGER, tile_row INTEGER, tile_id TEXT);
CREATE TABLE images(tile_id TEXT, tile_data BLOB);
CREATE UNIQUE INDEX map_index ON map(zoom_level, tile_column, tile_row);
CREATE UNIQUE INDEX images_id ON images(tile_id);
CREATE UNIQUE INDEX metadata_name ON metadata(name);
CREATE VIEW tiles AS SELECT zoom_level, tile_column, tile_row, tile_data FROM map JOIN images ON images.tile_id = map.tile_id;
)";

/// To write the archive: what SQLite complains of is not the store that is read.
class MbtilesOutput {
 public:
  MbtilesOutput(const std::string& path, const fs::path& sibling) : path_(path) {
    write([&] {
      database_.emplace(sibling.string(), Database::Mode::create);
      database_->execute(kTables);
    });
  }
  Database& database() { return *database_; }
  template <class Work>
  void write(const Work& work) const {
    try {
      work();
    } catch (const StoreError& error) { throw Refused{unwritable(path_, error.what())}; }
  }

 private:
  const std::string& path_;
  std::optional<Database> database_;
};

struct Zooms {
  int least = 99, most = 0;
};

struct MapTile {
  faces::Place at;
  std::string id, bytes;
};

Zooms write_tiles(const faces::Terrain& terrain, const faces::Face& face, const ExportWork& work, MbtilesOutput& output) {
  ExportProgress progress(work.progress);
  const faces::Resource& tiles = *tiles_of(face);
  Statement image(output.database(), "INSERT OR IGNORE INTO images VALUES (CAST(? AS TEXT), ?)");
  Statement place(output.database(), "INSERT OR IGNORE INTO map VALUES (?, ?, ?, CAST(? AS TEXT))");
  Zooms zooms;
  faces::Batches<MapTile> all(
      work.threads,
      [&](MapTile& tile) {
        const faces::Document document = made(terrain, tiles, tile.at);
        tile.id = hex(content_hash(document.bytes));
        tile.bytes = tiles.type == faces::kVectorTile ? gzip(document.bytes) : std::string(document.bytes);
      },
      [&](MapTile& tile) {
        output.write([&] {
          image.bind(tile.id, tile.bytes).run();
          place.bind(tile.at.z, tile.at.x, proto::tiles_up(tile.at.z) - 1 - tile.at.y, tile.id).run();
        });
        zooms = {std::min(zooms.least, tile.at.z), std::max(zooms.most, tile.at.z)};
        progress.next();
      });
  progress.expect(terrain, [&](const auto& one) {
    each_place(terrain, face, tiles, {1, faces::Named::expected}, [&](const faces::Place&) { one(); });
  });
  each_place(terrain, face, tiles, work.threads, [&](const faces::Place& at) { all.add({at, {}, {}}); });
  all.finish();
  progress.finish();
  return zooms;
}

void write_metadata(const faces::Terrain& terrain, const faces::Face& face, Zooms zooms, MbtilesOutput& output) {
  const proto::Manifest& manifest = terrain.manifest();
  const faces::Resource& tiles = *tiles_of(face);
  const Extent extent = extent_of(manifest, tiles.grid);
  Statement row(output.database(), "INSERT INTO metadata VALUES (CAST(? AS TEXT), CAST(? AS TEXT))");
  const auto say = [&](const std::string& name, const std::string& value) {
    if (!value.empty()) output.write([&] { row.bind(name, value).run(); });
  };
  say("name", title_of(manifest));
  say("format", format_name(tiles));
  say("bounds", with_commas({extent.west, extent.south, extent.east, extent.north}));
  const int least = std::min(zooms.least, zooms.most);
  const View view = view_of(manifest, tiles.grid, least, zooms.most);
  say("center", with_commas({view.longitude_deg, view.latitude_deg}) + "," + std::to_string(view.zoom));
  say("minzoom", std::to_string(least));
  say("maxzoom", std::to_string(zooms.most));
  say("attribution", html_text(manifest.attribution()));
  say("description", std::string(tiles.about));
  say("type", layer_type(tiles));
  say("version", "1");
  say("encoding", pixel_encoding(terrain, face));
  if (tiles.type == faces::kVectorTile)
    say("json", Json{{"vector_layers", vector_layers(terrain, face, least, zooms.most)}}.dump());
}

}  // namespace

bool fits_mbtiles(const faces::Face& face) {
  const faces::Resource* tiles = tiles_of(face);
  return tiles != nullptr && tiles->grid == faces::Grid::web_mercator &&
         (tiles->type.starts_with("image/") || tiles->type == faces::kVectorTile);
}

proto::Result<void> write_mbtiles(const faces::Terrain& terrain, const faces::Face& face, const std::string& path, Existing other,
                                  const ExportWork& work) {
  return write_export(path, other, [&](const fs::path& sibling) {
    MbtilesOutput output(path, sibling);
    Transaction all(output.database());
    write_metadata(terrain, face, write_tiles(terrain, face, work, output), output);
    output.write([&] { all.commit(); });
  });
}

}  // namespace cordillera::pipeline::exports
