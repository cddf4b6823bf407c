#include "pipeline/store/store_revise.h"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/store/store_sums.h"
#include "raster/disk/descriptor.h"
#include "raster/disk/free_space.h"
#include "raster/disk/write_all.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;

/// By reference where the file system can (Btrfs, XFS), which takes no room, else byte by byte.
proto::Result<void> copy_file(const std::string& from, const std::string& to) {
  raster::Descriptor in(::open(from.c_str(), O_RDONLY | O_CLOEXEC)),
      out(::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  const bool both = in.is_open() && out.is_open();
  bool copied = both && ioctl(out.number(), FICLONE, in.number()) == 0;
  std::error_code error;
  const auto size = fs::file_size(from, error);
  const auto full =
      copied || error ? std::nullopt : raster::no_room(to, size, "the version before, on which the next one is built");
  for (ssize_t count = 1; both && !copied && !full; copied = count == 0) {
    count = copy_file_range(in.number(), nullptr, out.number(), nullptr, std::size_t{1} << 30, 0);
    if (count < 0) break;
  }
  const std::string why = std::strerror(errno);
  in.close(), out.close();
  if (full) return *full;
  if (copied) return {};
  // A file system that knows neither.
  if (!fs::copy_file(from, to, fs::copy_options::overwrite_existing, error) || error)
    throw StoreError(error ? error.message() : why);
  return {};
}

/// Takes the tiles of a task away. What a block made lies below its node; the other task has made all above.
class Remover {
 public:
  Remover(Database& database, const Revision& revision)
      : revision_(revision),
        note_(database,
              "INSERT OR IGNORE INTO gone SELECT drc FROM tiles WHERE level = ?1 AND y = ?2 AND x BETWEEN ?3 AND ?4 "
              "UNION SELECT glb FROM tiles WHERE level = ?1 AND y = ?2 AND x BETWEEN ?3 AND ?4"),
        tiles_(database, "DELETE FROM tiles WHERE level = ? AND y = ? AND x BETWEEN ? AND ?"),
        water_(database, "DELETE FROM water WHERE level = ? AND y = ? AND x BETWEEN ? AND ?"),
        lost_(database, "DELETE FROM lost WHERE level = ? AND y = ? AND x BETWEEN ? AND ?"),
        mesh_(database, "DELETE FROM meshes WHERE level = ? AND y = ? AND x = ?"),
        note_above_(
            database,
            "INSERT OR IGNORE INTO gone SELECT drc FROM tiles WHERE level < ?1 UNION SELECT glb FROM tiles WHERE level < ?1"),
        tiles_above_(database, "DELETE FROM tiles WHERE level < ?") {}

  void remove(const proto::TileAddress& node) {
    if (node.z < revision_.block_level) {
      note_above_.bind(revision_.block_level).run();
      tiles_above_.bind(revision_.block_level).run();
      return;
    }
    const int deepest = node.z == revision_.block_level ? revision_.finest_level : node.z;
    for (int z = node.z; z <= deepest; ++z) {
      const int down = z - node.z;
      const std::int32_t x0 = node.x << down, y0 = node.y << down, last = (1 << down) - 1;
      for (std::int32_t y = y0; y <= y0 + last; ++y) {
        note_.bind(z, y, x0, x0 + last).run();
        tiles_.bind(z, y, x0, x0 + last).run();
        water_.bind(z, y, x0, x0 + last).run();
        lost_.bind(z, y, x0, x0 + last).run();
      }
    }
    mesh_.bind(node.z, node.y, node.x).run();
  }

 private:
  const Revision& revision_;
  Statement note_, tiles_, water_, lost_, mesh_, note_above_, tiles_above_;
};

void revise(Database& database, const proto::Plan& plan, const Revision& revision) {
  database.execute("CREATE TEMP TABLE gone(hash BLOB PRIMARY KEY) WITHOUT ROWID");
  Transaction transaction(database);
  database.execute("DROP TABLE nodes; DELETE FROM meta WHERE key = 'manifest'");
  database.execute(kCreateWater);
  database.execute(kCreateLost);
  // Those above the blocks are made anew of all blocks.
  Statement(database, "DELETE FROM water WHERE level < ?").bind(revision.block_level).run();
  database.execute("CREATE TABLE tasks(level INT, y INT, x INT, PRIMARY KEY(level, y, x)) WITHOUT ROWID");
  add_sums(database);
  database.execute("PRAGMA user_version=" + std::to_string(kSchemaVersion));
  const std::string key = "plan", bytes = plan.SerializeAsString();
  Statement(database, kPutMeta).bind(key, bytes).run();
  {
    Remover remover(database, revision);
    for (const proto::TileAddress& node : revision.stale) remover.remove(node);
    Statement put(database, "INSERT INTO tasks(level, y, x) VALUES(?, ?, ?)");
    for (const proto::TileAddress& node : revision.finished) put.bind(node.z, node.y, node.x).run();
  }
  // Equal tiles share their bytes: a tile that stays may have those of one that goes.
  database.execute("DELETE FROM temp.gone WHERE hash IN (SELECT drc FROM tiles UNION ALL SELECT glb FROM tiles)");
  database.execute("DELETE FROM blobs WHERE hash IN (SELECT hash FROM temp.gone)");
  transaction.commit();
}

void put_notes(const std::string& path, const std::vector<Note>& notes) {
  Database database(path, Database::Mode::create);
  Transaction transaction(database);
  Statement put(database, kPutMeta);
  for (const Note& note : notes) put.bind(note.key, note.text).run();
  transaction.commit();
}

}  // namespace

proto::Problem store_write_problem(const std::string& path, const std::string& why) {
  return {"store-write", "the store " + path + " cannot be written: " + why,
          "a writable file on a disk with free space, used by one job at a time", ""};
}

std::optional<std::string> sound_note_in(const std::string& store_path, const std::string& key) {
  std::error_code error;
  if (!fs::exists(store_path, error)) {
    if (error) throw StoreError(store_path + " cannot be looked for: " + error.message());
    return std::nullopt;
  }
  Database database(store_path, Database::Mode::published);
  if (const std::string code = database.code_in_schema(); !code.empty())
    throw StoreError(store_path + " has what no store has: " + code);
  Statement row(database,
                "SELECT value, " + std::string(has_sums(database) ? kSoundMeta : "1") + " FROM meta WHERE key = CAST(? AS TEXT)");
  if (!row.bind(key).step()) return std::nullopt;
  if (row.integer(1) == 0) throw StoreError("the note '" + key + "' of " + store_path + " is not as it was written");
  return std::string(row.blob(0));
}

std::optional<std::string> note_in(const std::string& store_path, const std::string& key) {
  try {
    return sound_note_in(store_path, key);
  } catch (const StoreError&) {
    return std::nullopt;  // whoever opens it for its tiles says why
  }
}

proto::Result<void> revise_store(const std::string& from, const std::string& to, const proto::Plan& plan,
                                 const Revision& revision) {
  const std::string copy = to + ".copy";
  try {
    remove_store(copy);
    remove_store(to);
    if (const auto copied = copy_file(from, copy); !copied.ok()) {
      remove_store(copy);
      return copied.problem();
    }
    {
      Database database(copy, Database::Mode::create);
      // Nothing but this process knows of the copy: it needs no journal that survives.
      database.execute("PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF");
      revise(database, plan, revision);
    }
    if (!raster::sync_path(copy) || !raster::put_in_place(copy, to)) throw StoreError(std::strerror(errno));
    return {};
  } catch (const std::exception& failed) {
    remove_store(copy);
    return store_write_problem(to, failed.what());
  }
}

proto::Result<void> begin_store(const std::string& path, const proto::Plan& plan, const std::vector<Note>& notes) {
  {
    const auto store = StoreWriter::open(path, plan);
    if (!store.ok()) return store.problem();
  }
  try {
    put_notes(path, notes);
    return {};
  } catch (const StoreError& failed) { return store_write_problem(path, failed.what()); }
}

}  // namespace cordillera::pipeline
