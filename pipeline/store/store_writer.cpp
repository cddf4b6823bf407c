#include <algorithm>
#include <filesystem>
#include <mutex>
#include <set>

#include "pipeline/store/content_hash.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_publish.h"
#include "pipeline/store/store_revise.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/store/store_sums.h"
#include "pipeline/store/water_mask.h"
#include "raster/disk/free_space.h"

namespace cordillera::pipeline {
namespace {

using proto::Problem;
using proto::TileAddress;

std::uint64_t bytes_of(const std::vector<TileWater>& masks) {
  std::uint64_t bytes = 0;
  for (const TileWater& mask : masks) bytes += mask.packed.size();
  return bytes;
}

/// What a task leaves in the store, about.
std::uint64_t bytes_of(const FinishedTask& task) {
  constexpr std::uint64_t kRow = 1024;  // a record, its sum and its places in the trees
  std::uint64_t bytes = task.mesh ? task.mesh->second.size() + kRow : 0;
  for (const EncodedTile& tile : task.tiles) bytes += tile.drc.size() + tile.glb.size() + kRow;
  return bytes + bytes_of(task.water);
}

// Everything that is asked for while tiles are made. Gone once the tables are.
struct WorkStatements {
  explicit WorkStatements(Database& d)
      : put_tile(d, kPutTile),
        put_blob(d, "INSERT OR IGNORE INTO blobs(hash, bytes) VALUES(?, ?)"),
        put_task(d, "INSERT OR REPLACE INTO tasks(level, y, x) VALUES(?, ?, ?)"),
        has_task(d, "SELECT 1 FROM tasks WHERE level = ? AND y = ? AND x = ?"),
        put_mesh(d, "INSERT OR REPLACE INTO meshes(level, y, x, bytes) VALUES(?, ?, ?, ?)"),
        get_mesh(d, "SELECT bytes FROM meshes WHERE level = ? AND y = ? AND x = ?"),
        drop_mesh(d, "DELETE FROM meshes WHERE level = ? AND y = ? AND x = ?"),
        put_lost(d, kPutLost) {}
  Statement put_tile, put_blob, put_task, has_task, put_mesh, get_mesh, drop_mesh, put_lost;
};

class SqliteWriter final : public StoreWriter {
 public:
  SqliteWriter(std::string path, proto::Plan plan) : path_(std::move(path)), plan_(std::move(plan)), files_(path_) {}
  ~SqliteWriter() override {
    try {
      if (!work_ || without_data_.empty()) return;
      Transaction transaction(*database_);
      put_without_data();
      transaction.commit();
    } catch (const StoreError&) {  // they are looked at again, then
    }
  }

  /// What is in the file's place. damaged: a store whose manifest cannot be read, so that nobody can use it.
  enum class Found { ours, others, damaged };

  /// Ready for work if ours is found, or nothing. Throws StoreError.
  Found start() {
    database_ = std::make_unique<Database>(path_, Database::Mode::create);
    database_->execute("PRAGMA locking_mode=EXCLUSIVE; PRAGMA synchronous=FULL; PRAGMA auto_vacuum=INCREMENTAL");
    const bool fresh = database_->integer("SELECT count(*) FROM sqlite_schema") == 0;
    if (!fresh && !same_plan()) return Found::others;
    if (!database_->code_in_schema().empty()) return Found::damaged;
    if (!fresh && has_note("manifest")) {
      if (!read_manifest()) return Found::damaged;
      settle();
      return Found::ours;
    }
    // A commit is one sync of the log; it is on the disk when commit() returns.
    database_->execute("PRAGMA journal_mode=WAL");
    fresh ? create() : bring_up_to_date();
    if (fresh) files_.drop_all();  // another store's, which is gone
    keeps_meshes_ = has_note(kTasksNote);
    has_water_ = has_water(plan_.options());
    if (has_water_) database_->execute(kCreateWater);
    database_->execute(kCreateLost);
    work_ = std::make_unique<WorkStatements>(*database_);
    return Found::ours;
  }

  bool finished(const TileAddress& node) const override {
    const std::lock_guard lock(mutex_);
    if (published_) return true;
    if (!work_) return false;
    if (std::find(without_data_.begin(), without_data_.end(), node) != without_data_.end()) return true;
    const bool there = work_->has_task.bind(node.z, node.y, node.x).step();
    work_->has_task.bind();
    const auto left = there ? mesh_row(node) : std::nullopt;
    return there && (!left || !is_hash(*left) || files_.has(node));
  }

  void keep(FinishedTask& task) override {
    if (!task.mesh || task.mesh_is_kept || keeps_meshes_ || raster::no_room(path_, bytes_of(task), "tiles")) return;
    try {
      files_.put(task.mesh->first, task.mesh->second);
      task.mesh->second = content_hash(task.mesh->second);
      task.mesh_is_kept = true;
    } catch (const StoreError&) {}  // commit() comes to it, too
  }

  proto::Result<void> commit(const FinishedTask& task) override {
    const std::lock_guard lock(mutex_);
    if (published_) return store_write_problem(path_, "it is published");
    if (!work_) return store_write_problem(path_, "it cannot be read");
    // Nothing is lost with one of these but a look at its place. A sparse raster has thousands, and each sync takes as long as
    // that of a block.
    if (task.tiles.empty() && !task.mesh && task.consumed.empty() && without_data_.size() < kMostWithoutData) {
      without_data_.push_back(task.node);
      return {};
    }
    if (auto full = no_room_for(bytes_of(task))) return *full;
    try {
      const bool as_it_is = keeps_meshes_ || task.mesh_is_kept;
      if (task.mesh && !as_it_is) files_.put(task.mesh->first, task.mesh->second);  // before the row that tells of it
      Transaction transaction(*database_);
      for (const EncodedTile& tile : task.tiles) put(tile);
      put(task.water);
      if (task.mesh) {
        const TileAddress& at = task.mesh->first;
        work_->put_mesh.bind(at.z, at.y, at.x, as_it_is ? task.mesh->second : content_hash(task.mesh->second)).run();
      }
      for (const TileAddress& child : task.consumed) work_->drop_mesh.bind(child.z, child.y, child.x).run();
      work_->put_task.bind(task.node.z, task.node.y, task.node.x).run();
      put_without_data();
      transaction.commit();
      without_data_.clear();
      // Those of all blocks at once go with their folder, when the store is published next.
      if (task.consumed.size() <= kMostDropped)
        for (const TileAddress& child : task.consumed) files_.drop(child);
      return {};
    } catch (const StoreError& e) { return store_write_problem(path_, e.what()); }
  }

  FinishedTask block(const TileAddress& node) const override {
    const std::lock_guard lock(mutex_);
    FinishedTask task;
    task.node = node;
    if (published_ || !database_) return task;
    Statement tiles(
        *database_,
        "SELECT record, bytes FROM tiles JOIN blobs ON hash = drc WHERE level = ? AND y BETWEEN ? AND ? AND x BETWEEN ? AND ?");
    for (int z = node.z; z <= static_cast<int>(plan_.finest_level()); ++z) {
      bind_below(tiles, node, z);
      while (tiles.step()) {
        EncodedTile tile;
        const std::string_view record = tiles.blob(0);
        if (!tile.record.ParseFromArray(record.data(), static_cast<int>(record.size())))
          throw StoreError("a tile's record cannot be read");
        tile.drc = tiles.blob(1);
        task.tiles.push_back(std::move(tile));
      }
    }
    if (has_water_) read_water_below(task);
    return task;
  }

  std::optional<std::string> mesh(const TileAddress& node) const override {
    const auto left = [&]() -> std::optional<std::string> {
      const std::lock_guard lock(mutex_);
      return published_ || !work_ ? std::nullopt : mesh_row(node);
    }();
    if (!left || !is_hash(*left)) return left;
    auto bytes = files_.get(node);
    const auto is_known = [&] {  // levels above blocks are made of the same bytes, one after the other
      const std::lock_guard lock(mutex_);
      return sound_.contains(node);
    };
    if (!bytes || (!is_known() && content_hash(*bytes) != *left))
      throw StoreError("what block " + std::to_string(node.z) + "/" + std::to_string(node.x) + "/" + std::to_string(node.y) +
                       " has left is not as it was written");
    const std::lock_guard lock(mutex_);
    sound_.insert(node);
    return bytes;
  }

  std::string water(const TileAddress& tile) const override {
    const std::lock_guard lock(mutex_);
    if (published_ || !has_water_) return "";
    Statement mask(*database_, "SELECT mask FROM water WHERE level = ? AND y = ? AND x = ?");
    return mask.bind(tile.z, tile.y, tile.x).step() ? std::string(mask.blob(0)) : "";
  }

  proto::Result<void> put_water(const std::vector<TileWater>& masks) override {
    const std::lock_guard lock(mutex_);
    if (published_) return {};
    if (auto full = no_room_for(bytes_of(masks))) return *full;
    try {
      Transaction transaction(*database_);
      put(masks);
      transaction.commit();
      return {};
    } catch (const StoreError& e) { return store_write_problem(path_, e.what()); }
  }

  proto::Result<proto::Manifest> publish(proto::Manifest manifest) override {
    const std::lock_guard lock(mutex_);
    if (published_) return *published_;
    if (!work_) return store_write_problem(path_, "it cannot be read");
    try {
      // What takes the place of the meshes moves there.
      if (auto full = no_room_for(static_cast<std::uint64_t>(database_->integer("SELECT total(length(bytes)) FROM meshes"))))
        return *full;
      work_.reset();  // their tables are about to go
      publish_in_one(manifest);
      settle();
      published_ = manifest;
      return manifest;
    } catch (const NothingToPublish& e) {
      resume();
      return Problem{"no-data", path_ + " cannot be published: " + e.what(), "a raster with data", ""};
    } catch (const StoreError& e) {
      resume();
      return store_write_problem(path_, e.what());
    }
  }

 private:
  static constexpr std::size_t kMostWithoutData = 256;
  static constexpr std::size_t kMostDropped = 4;  // children of one merge

  void put_without_data() {
    for (const TileAddress& node : without_data_) work_->put_task.bind(node.z, node.y, node.x).run();
  }

  /// For bytes that go into the log first, and with it into the file.
  std::optional<Problem> no_room_for(std::uint64_t bytes) const {
    std::error_code error;
    const auto log = std::filesystem::file_size(path_ + "-wal", error);
    return raster::no_room(path_, (error ? 0 : log) + 2 * bytes, "tiles");
  }

  bool same_plan() {
    if (database_->integer("PRAGMA application_id") != kApplicationId) throw StoreError("it is no store of Cordillera");
    const std::int64_t version = database_->integer("PRAGMA user_version");
    if (version < kOldestSchema || version > kSchemaVersion) return false;
    Statement plan(*database_, "SELECT value FROM meta WHERE key = 'plan'");
    return plan.step() && plan.blob(0) == plan_.SerializeAsString();
  }

  /// After publishing failed: it is published all the same, where folding the log in was what failed, or work goes on. Neither,
  /// if the disk cannot even be read any more: then nothing is finished and every commit is refused.
  void resume() {
    try {
      if (!read_manifest()) work_ = std::make_unique<WorkStatements>(*database_);
    } catch (const StoreError&) { work_.reset(); }
  }

  // Readers take a published file as it is, without a log beside it. Nothing is left to do with it here: it is closed.
  void settle() {
    {
      Statement mode(*database_, "PRAGMA journal_mode=DELETE");
      if (!mode.step() || mode.blob(0) != "delete") throw StoreError("its log cannot be folded in");
    }
    database_.reset();
    files_.drop_all();
  }

  /// What meshes has of a node: the bytes, or the hash of a file's.
  std::optional<std::string> mesh_row(const TileAddress& node) const {
    if (!work_->get_mesh.bind(node.z, node.y, node.x).step()) return std::nullopt;
    std::string bytes(work_->get_mesh.blob(0));
    work_->get_mesh.bind();
    return bytes;
  }
  /// As content_hash has them; no mesh is as short.
  static bool is_hash(const std::string& row) { return row.size() == kHashBytes; }

  void create() {
    Transaction transaction(*database_);
    database_->execute(kCreateTables);
    database_->execute("PRAGMA application_id=" + std::to_string(kApplicationId));
    database_->execute("PRAGMA user_version=" + std::to_string(kSchemaVersion));
    Statement(*database_, kPutMeta).bind(std::string("plan"), plan_.SerializeAsString()).run();
    transaction.commit();
  }

  /// An unfinished store of an earlier version: rows that are added need not be what that version knows.
  void bring_up_to_date() {
    add_sums(*database_);
    database_->execute("PRAGMA user_version=" + std::to_string(kSchemaVersion));
  }

  bool has_note(const std::string& key) {
    Statement row(*database_, "SELECT 1 FROM meta WHERE key = CAST(? AS TEXT)");
    return row.bind(key).step();
  }

  /// False: there is none, or it is damaged.
  bool read_manifest() {
    Statement row(*database_, "SELECT value FROM meta WHERE key = 'manifest'");
    if (!row.step()) return false;
    const std::string_view bytes = row.blob(0);
    proto::Manifest manifest;
    if (!manifest.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return false;
    published_ = std::move(manifest);
    return true;
  }

  void put(const EncodedTile& tile) {
    proto::TileRecord record = tile.record;
    if (!tile.shows()) {
      work_->put_lost.bind(record.level(), record.y(), record.x(), record.SerializeAsString()).run();
      return;
    }
    record.set_drc_bytes(static_cast<std::uint32_t>(tile.drc.size()));
    record.set_glb_bytes(static_cast<std::uint32_t>(tile.glb.size()));
    if (record.region_size() != 6) throw StoreError("a tile without a region of six numbers");
    const std::string drc = content_hash(tile.drc), glb = tile.glb.empty() ? "" : content_hash(tile.glb),
                      bytes = record.SerializeAsString();
    work_->put_blob.bind(drc, tile.drc).run();
    if (!glb.empty()) work_->put_blob.bind(glb, tile.glb).run();
    const auto& r = record.region();
    work_->put_tile
        .bind(record.level(), record.y(), record.x(), bytes, drc, glb, record.max_error(), r[0], r[1], r[2], r[3], r[4], r[5])
        .run();
  }

  void put(const std::vector<TileWater>& masks) {
    if (masks.empty()) return;
    Statement row(*database_,
                  "INSERT OR REPLACE INTO water(level, y, x, mask, sum) VALUES(?1, ?2, ?3, ?4, row_sum(?1, ?2, ?3, ?4))");
    for (const auto& [tile, packed] : masks) row.bind(tile.z, tile.y, tile.x, packed).run();
  }

  /// Level z of what lies below a node, for a statement that asks for a level, rows between two and columns between two.
  static void bind_below(Statement& statement, const TileAddress& node, int z) {
    const int below = z - node.z;
    const auto first = [below](std::int32_t at) { return std::int64_t{at} << below; };
    const auto last = [below](std::int32_t at) { return ((std::int64_t{at} + 1) << below) - 1; };
    statement.bind(z, first(node.y), last(node.y), first(node.x), last(node.x));
  }
  void read_water_below(FinishedTask& task) const {
    Statement masks(*database_, "SELECT y, x, mask FROM water WHERE level = ? AND y BETWEEN ? AND ? AND x BETWEEN ? AND ?");
    for (int z = task.node.z; z <= static_cast<int>(plan_.finest_level()); ++z) {
      bind_below(masks, task.node, z);
      while (masks.step()) {
        const auto y = static_cast<std::int32_t>(masks.integer(0)), x = static_cast<std::int32_t>(masks.integer(1));
        task.water.push_back({{z, x, y}, std::string(masks.blob(2))});
      }
    }
  }

  void publish_in_one(proto::Manifest& manifest) {
    Transaction transaction(*database_);
    database_->execute("DROP TABLE tasks");
    // One that will be built on keeps what its tasks left for those above.
    if (!has_note(kTasksNote)) database_->execute("DROP TABLE meshes");
    make_nodes(*database_, static_cast<int>(plan_.finest_level()));
    summarise(*database_, plan_, manifest);
    Statement(*database_, kPutMeta).bind(std::string("manifest"), manifest.SerializeAsString()).run();
    database_->execute("PRAGMA incremental_vacuum");
    transaction.commit();
  }

  std::string path_;
  proto::Plan plan_;
  MeshFiles files_;
  std::vector<TileAddress> without_data_;  ///< finished blocks that the file does not tell of yet
  bool keeps_meshes_ = false;              ///< in the store, for who builds on it
  bool has_water_ = false;                 ///< its tiles may have masks
  mutable std::mutex mutex_;
  mutable std::set<TileAddress> sound_;  ///< blocks whose files have been held against their hashes
  std::unique_ptr<Database> database_;
  std::unique_ptr<WorkStatements> work_;
  std::optional<proto::Manifest> published_;
};

}  // namespace

proto::Problem output_exists(const std::string& what) {
  return {"output-exists", what, "another place, or --overwrite to replace what is there", "output"};
}

proto::Result<std::unique_ptr<StoreWriter>> StoreWriter::open(const std::string& path, const proto::Plan& plan, Existing other) {
  try {
    auto writer = std::make_unique<SqliteWriter>(path, plan);
    if (const auto found = writer->start(); found != SqliteWriter::Found::ours) {
      const bool damaged = found == SqliteWriter::Found::damaged;
      if (other == Existing::refuse)
        return output_exists(path +
                             (damaged ? " holds a damaged build" : " holds a build of another raster or with other options"));
      writer = std::make_unique<SqliteWriter>(path, plan);
      remove_store(path);
      if (writer->start() != SqliteWriter::Found::ours) return store_write_problem(path, "the old file could not be removed");
    }
    return std::unique_ptr<StoreWriter>(std::move(writer));
  } catch (const StoreError& e) { return store_write_problem(path, e.what()); }
}

}  // namespace cordillera::pipeline
