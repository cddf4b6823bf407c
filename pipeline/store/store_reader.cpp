#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <vector>

#include "pipeline/encode/tile_glb.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_connection.h"
#include "pipeline/store/store_object.h"
#include "pipeline/store/store_sums.h"
#include "pipeline/store/store_words.h"
#include "raster/storage/storage.h"

namespace cordillera::pipeline {

std::string name_of(const proto::TileAddress& tile) {
  return "tile " + std::to_string(tile.z) + "/" + std::to_string(tile.x) + "/" + std::to_string(tile.y);
}

namespace {

using proto::Problem;
using proto::TileAddress;

constexpr std::size_t kConnections = 4;
constexpr std::uint64_t kOwnCache_bytes = std::uint64_t{64} << 20;
// A window of few rows is asked row by row: the key finds each run of columns at once. A tall one is one scan.
constexpr std::int32_t kFewRows = 256;
// Tiles that are looked for when a store is opened: 3 ms a thousand. Counting alone would be cheaper, but takes every page of the
// table: 235 ms for a million tiles that the system has in memory, and as long as the disk takes for 330 MB that it has not.
constexpr std::uint64_t kMostCounted = 20000;

Problem refused(const std::string& type, const std::string& path, const std::string& why) {
  return {type, path + " " + why, "the store of a dataset whose build has finished", ""};
}

/// The row that a statement stands on is to be used.
void require_sound(const Statement& row, const TileAddress& tile) {
  if (row.integer(0) == 0) throw StoreError("the row of " + name_of(tile) + " is not as it was written");
}

proto::TileRecord record_of(const Statement& row, int column) {
  proto::TileRecord record;
  const std::string_view bytes = row.blob(column);
  if (!record.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) throw StoreError("a tile record is damaged");
  return record;
}

/// In a store without sums, whether the bytes are this tile's, as far as its record tells.
void require_own(const proto::TileRecord& record, const TileAddress& tile, Encoding encoding, std::size_t bytes) {
  const bool here = record.level() == static_cast<std::uint32_t>(tile.z) && record.x() == static_cast<std::uint32_t>(tile.x) &&
                    record.y() == static_cast<std::uint32_t>(tile.y);
  const std::size_t stated = encoding == Encoding::drc ? record.drc_bytes() : record.glb_bytes();
  if (!here || stated != bytes) throw StoreError("the bytes of " + name_of(tile) + " are not those that its record tells of");
}

template <class Row>
void for_each_row(Statement& statement, std::array<std::int32_t, 5> window, const Row& row) {
  const auto [level, x0, y0, x1, y1] = window;
  const std::int32_t tall = y1 - y0 >= kFewRows ? y1 - y0 : 0;
  for (std::int32_t y = y0; y <= y1; y += tall + 1) {
    statement.bind(level, y, y + tall, x0, x1);
    while (statement.step()) row();
  }
}

class SqliteReader final : public StoreReader {
 private:
  // A few connections, one thread each: tiles are small and mostly in the page cache, so nobody waits long.
  // (Stands first: a deduced return type must be known before it is used.)
  template <class Use>
  static auto counted(StoreConnection& c, const Use& use) {
    auto out = use(c);
    c.cache_bytes = c.database.cache_bytes();
    return out;
  }
  template <class Use>
  auto with_connection(const Use& use) const {
    const std::size_t first = turn_.fetch_add(1, std::memory_order_relaxed);
    for (std::size_t k = 0; k < kConnections; ++k) {
      StoreConnection& c = *connections_[(first + k) % kConnections];
      if (const std::unique_lock lock(c.mutex, std::try_to_lock); lock) return counted(c, use);
    }
    StoreConnection& c = *connections_[first % kConnections];
    const std::lock_guard lock(c.mutex);
    return counted(c, use);
  }

 public:
  /// plan: none where it cannot be read; then no .glb can be made.
  SqliteReader(StoreAddress place, proto::Manifest manifest, std::optional<proto::Plan> plan)
      : place_(std::move(place)), manifest_(std::move(manifest)), plan_(std::move(plan)) {
    for (auto& c : connections_) c = std::make_unique<StoreConnection>(place_);
  }

  const proto::Manifest& manifest() const override { return manifest_; }

  int block_level() const override { return plan_ ? static_cast<int>(plan_->block_level()) : 0; }

  double glb_step_m(int level) const override {
    const proto::LevelPlan* const of = plan_ ? find_level(*plan_, level) : nullptr;
    return of != nullptr ? ecef_steps(*of).coarsest_m : 0;
  }

  std::optional<Blob> tile(const TileAddress& tile, Encoding encoding) const override {
    const auto found =
        with_connection([&](StoreConnection& c) { return read(c, encoding == Encoding::drc ? c.drc : c.glb, tile, encoding); });
    if (!found || !found->blob.etag.empty()) return found ? std::optional(found->blob) : std::nullopt;
    return made(tile, {});  // the connection is free meanwhile
  }

  std::optional<Blob> glb(const TileAddress& tile, const Shading& shading) const override { return made(tile, shading); }

  std::optional<std::string> tag(const TileAddress& tile, Encoding encoding) const override {
    const auto found = with_connection([&](StoreConnection& c) -> std::optional<std::string> {
      if (!c.tags.bind(tile.z, tile.y, tile.x).step()) return std::nullopt;
      require_sound(c.tags, tile);
      return hex(c.tags.blob(encoding == Encoding::drc ? 1 : 2));
    });
    if (!found || !found->empty()) return found;
    const auto blob = made(tile, {});
    return blob ? std::optional(blob->etag) : std::nullopt;
  }

  std::size_t cache_bytes() const override {
    std::size_t all = 0;
    for (const auto& c : connections_) all += c->cache_bytes;
    return all;
  }

  std::string water(const TileAddress& tile) const override {
    return with_connection([&](StoreConnection& c) {
      if (!c.water || !c.water->bind(tile.z, tile.y, tile.x).step()) return std::string();
      require_sound(*c.water, tile);
      return std::string(c.water->blob(1));
    });
  }

  std::optional<proto::TileRecord> record(const TileAddress& tile) const override {
    auto found = records(tile.z, tile.x, tile.y, tile.x, tile.y);
    if (found.empty()) return std::nullopt;
    return std::move(found[0]);
  }

  std::vector<proto::TileRecord> records(int level, std::int32_t x0, std::int32_t y0, std::int32_t x1,
                                         std::int32_t y1) const override {
    return with_connection([&](StoreConnection& c) {
      std::vector<proto::TileRecord> out;
      for_each_row(c.records, {level, x0, y0, x1, y1}, [&] {
        require_sound(c.records,
                      {level, static_cast<std::int32_t>(c.records.integer(3)), static_cast<std::int32_t>(c.records.integer(2))});
        out.push_back(record_of(c.records, 1));
      });
      return out;
    });
  }

  std::vector<TileExtent> extents(int level, std::int32_t x0, std::int32_t y0, std::int32_t x1, std::int32_t y1) const override {
    return with_connection([&](StoreConnection& c) {
      std::vector<TileExtent> out;
      for_each_row(c.nodes, {level, x0, y0, x1, y1}, [&] {
        TileExtent& e = out.emplace_back();
        e.tile = {level, static_cast<std::int32_t>(c.nodes.integer(2)), static_cast<std::int32_t>(c.nodes.integer(1))};
        require_sound(c.nodes, e.tile);
        e.geometric_error_m = c.nodes.real(3);
        for (int k = 0; k < 6; ++k) e.region[static_cast<std::size_t>(k)] = c.nodes.real(4 + k);
        e.content = c.nodes.integer(10) != 0;
      });
      return out;
    });
  }

 private:
  struct Found {
    Blob blob;  ///< its etag is empty where the encoding is not stored
    proto::TileRecord record;
  };
  static std::optional<Found> read(const StoreConnection& c, Statement& get, const TileAddress& tile, Encoding encoding) {
    if (!get.bind(tile.z, tile.y, tile.x).step()) return std::nullopt;
    require_sound(get, tile);
    const std::string_view bytes = get.blob(1), hash = get.blob(2);
    Found found{{}, record_of(get, 3)};
    if (encoding == Encoding::glb && hash.empty()) return found;
    pipeline::require_sound(bytes, hash);
    if (!c.summed) require_own(found.record, tile, encoding, bytes.size());
    found.blob = {std::string(bytes), hex(hash)};
    return found;
  }

  std::optional<Blob> made(const TileAddress& tile, const Shading& shading) const {
    const auto found = with_connection([&](StoreConnection& c) { return read(c, c.drc, tile, Encoding::drc); });
    if (!found) return std::nullopt;
    if (!plan_) throw StoreError("the plan is not as it was written");
    auto glb = tile_glb(*plan_, found->record, found->blob.bytes, shading);
    if (!glb) throw StoreError("the .glb of " + name_of(tile) + " cannot be made: " + glb.problem().detail);
    std::string etag = hex(content_hash(*glb));
    return Blob{std::move(*glb), std::move(etag)};
  }

  StoreAddress place_;  ///< outlives the connections
  proto::Manifest manifest_;
  std::optional<proto::Plan> plan_;
  std::array<std::unique_ptr<StoreConnection>, kConnections> connections_;
  mutable std::atomic<std::size_t> turn_{0};
};

proto::Result<proto::Manifest> published_manifest(Database& database, const std::string& path) {
  if (database.integer("PRAGMA application_id") != kApplicationId)
    return refused("store-unknown", path, "is no store of Cordillera");
  const std::int64_t version = database.integer("PRAGMA user_version");
  if (version < kOldestSchema || version > kSchemaVersion) {
    return refused("store-version", path, "was written by another version of Cordillera");
  }
  if (const std::string code = database.code_in_schema(); !code.empty())
    return refused("store-damaged", path, "has what no store has, and what would run while it is read: " + code);
  const std::string sound = has_sums(database) ? kSoundMeta : "1";
  Statement row(database, "SELECT " + sound + ", value FROM meta WHERE key = 'manifest'");
  if (!row.step()) return refused("store-unpublished", path, "is not finished");
  proto::Manifest manifest;
  const std::string_view bytes = row.blob(1);
  if (row.integer(0) == 0 || !manifest.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return refused("store-damaged", path, "has a damaged manifest");
  return manifest;
}

std::optional<proto::Plan> sound_plan(Database& database) {
  Statement row(database,
                "SELECT " + std::string(has_sums(database) ? kSoundMeta : "1") + ", value FROM meta WHERE key = 'plan'");
  proto::Plan plan;
  if (!row.step() || row.integer(0) == 0 || !plan.ParseFromArray(row.blob(1).data(), static_cast<int>(row.blob(1).size())))
    return std::nullopt;
  return plan;
}

// The size the header promises; a copy that was cut short has less.
bool whole(Database& database, std::uint64_t size) {
  return static_cast<std::uint64_t>(database.integer("PRAGMA page_count") * database.integer("PRAGMA page_size")) <= size &&
         database.integer("SELECT count(*) FROM sqlite_schema WHERE name IN ('tiles', 'blobs', 'nodes')") == 3;
}

/// The coarsest levels that have kMostCounted tiles together: all of them, in a store that is not large.
std::vector<proto::LevelSummary> counted_levels(const proto::Manifest& manifest) {
  std::vector<proto::LevelSummary> levels;
  std::uint64_t tiles = 0;
  for (auto level = manifest.levels().rbegin(); level != manifest.levels().rend(); ++level) {
    tiles += level->tiles();
    if (tiles > kMostCounted) break;
    levels.push_back(*level);
  }
  return levels;
}

/// Whether every tile that the manifest counts is found at its place, and its node at the same. A row that is gone, or one whose
/// key is another, says nothing when it is asked for: the level above would be shown in its place. What cannot be read is told
/// when it is.
bool all_there(Database& database, const proto::Manifest& manifest) {
  try {
    Statement count(database,
                    "SELECT count(*) FROM nodes n WHERE level = ? AND EXISTS(SELECT 1 FROM tiles t WHERE t.level = n.level AND "
                    "t.y = n.y AND t.x = n.x)");
    for (const proto::LevelSummary& level : counted_levels(manifest)) {
      if (!count.bind(level.level()).step() || count.integer(0) != static_cast<std::int64_t>(level.tiles())) return false;
    }
    return true;
  } catch (const StoreError&) { return true; }
}

/// Throws StoreError.
proto::Result<std::unique_ptr<StoreReader>> open_at(const StoreAddress& place, std::uint64_t size, const Words& words = {}) {
  const auto database = place.open();
  database->bound_steps(kStepsOfARow);
  auto manifest = published_manifest(*database, place.path);
  if (!manifest) return manifest.problem();
  if (!whole(*database, size)) return refused("store-damaged", place.path, "is cut short");
  // Object storage gives a page in the time in which a disk gives a thousand.
  if (!place.object && !all_there(*database, *manifest))
    return refused("store-damaged", place.path, "has not all of the tiles that its manifest tells of");
  put_words(words, *manifest);
  auto plan = sound_plan(*database);
  if (plan && words.attribution) plan->mutable_options()->set_attribution(*words.attribution);
  return std::unique_ptr<StoreReader>(std::make_unique<SqliteReader>(place, std::move(manifest).value(), std::move(plan)));
}

/// The size of a file of this machine that nobody is writing.
proto::Result<std::uint64_t> whole_file(const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) {
    const bool missing = errno == ENOENT || errno == ENOTDIR;
    return refused("store-missing", path,
                   missing ? "does not exist" : std::string("cannot be looked for: ") + std::strerror(errno));
  }
  if (!S_ISREG(file.st_mode)) return refused("store-unknown", path, "is no file");
  // Opened as immutable, a file is read without its log. A log with something in it means that the last write was cut short.
  for (const char* log : {"-wal", "-journal"}) {
    struct stat beside {};
    if (stat((path + log).c_str(), &beside) == 0 && beside.st_size > 0) {
      return refused("store-unpublished", path, "is being written, or was left in the middle of it");
    }
  }
  return static_cast<std::uint64_t>(file.st_size);
}

Problem damaged(const std::string& path, const StoreError& error) {
  if (dynamic_cast<const NoDescriptor*>(&error) != nullptr)
    return {"service-busy", path + " cannot be opened: " + error.what(), "trying again later", ""};
  return refused("store-damaged", path, std::string("cannot be read as a store: ") + error.what());
}

}  // namespace

std::vector<TileExtent> StoreReader::extents(int level, std::int32_t x0, std::int32_t y0, std::int32_t x1,
                                             std::int32_t y1) const {
  std::vector<TileExtent> out;
  for (const proto::TileRecord& record : records(level, x0, y0, x1, y1)) {
    TileExtent& e = out.emplace_back();
    e.tile = {level, static_cast<std::int32_t>(record.x()), static_cast<std::int32_t>(record.y())};
    e.content = true;
    e.geometric_error_m = record.max_error();
    for (int k = 0; k < std::min(6, record.region_size()); ++k) e.region[static_cast<std::size_t>(k)] = record.region(k);
  }
  return out;
}

proto::Result<std::unique_ptr<StoreReader>> StoreReader::open(const std::string& path) {
  if (raster::is_remote(path)) {
    auto file = raster::ObjectFile::open(path, std::make_shared<raster::BlockCache>(kOwnCache_bytes));
    return file ? open_store(std::move(*file)) : file.problem();
  }
  return open_store_with(path, {});
}

void put_words(const Words& words, proto::Manifest& manifest) {
  if (words.title) {
    manifest.set_title(words.title->empty() ? manifest.name() : *words.title);
    manifest.mutable_options()->set_title(manifest.title());
  }
  if (words.imagery) manifest.mutable_options()->set_imagery(*words.imagery);
  if (!words.attribution) return;
  manifest.set_attribution(*words.attribution);
  manifest.mutable_options()->set_attribution(*words.attribution);
}

proto::Result<std::unique_ptr<StoreReader>> open_store_with(const std::string& path, const Words& words) {
  const auto size = whole_file(path);
  if (!size) return size.problem();
  try {
    return open_at({path, nullptr}, *size, words);
  } catch (const StoreError& e) { return damaged(path, e); }
}

proto::Result<proto::Manifest> StoreReader::manifest_of(const std::string& path) {
  const auto size = whole_file(path);
  if (!size) return size.problem();
  try {
    Database database(path, Database::Mode::published);
    database.bound_steps(kStepsOfARow);
    return published_manifest(database, path);
  } catch (const StoreError& e) { return damaged(path, e); }
}

proto::Result<std::unique_ptr<StoreReader>> open_store(std::shared_ptr<raster::ObjectFile> file) {
  try {
    return open_at({file->path(), std::make_shared<const SqliteObject>(file)}, file->size());
  } catch (const StoreError& e) {
    const auto trouble = file->trouble();
    return trouble ? *trouble : damaged(file->path(), e);
  }
}

}  // namespace cordillera::pipeline
