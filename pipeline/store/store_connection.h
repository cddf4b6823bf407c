#pragma once
// A connection to a published store, with the statements that reading asks.
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "pipeline/store/sqlite.h"
#include "pipeline/store/sqlite_object.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/store/store_sums.h"

namespace cordillera::pipeline {

// Of one connection, KiB: what is above the leaves of a large dataset's trees. Tiles are kept by who asks for them.
inline constexpr const char* kPageCache = "PRAGMA cache_size = -512";

/// Where a store lies: a path of this machine, or an object.
struct StoreAddress {
  std::string path;
  std::shared_ptr<const SqliteObject> object;  ///< null: the path
  std::unique_ptr<Database> open() const {
    return object ? std::make_unique<Database>(*object) : std::make_unique<Database>(path, Database::Mode::published);
  }
  /// For a connection that stays.
  std::unique_ptr<Database> open_small() const {
    auto database = open();
    database->bound_steps(kStepsOfARow);
    database->execute(kPageCache);
    return database;
  }
};

/// Every row that these give has the answer to `sound` in its first column.
struct StoreConnection {
  explicit StoreConnection(const StoreAddress& place)
      : opened(place.open_small()),
        summed(has_sums(database)),
        drc(database, blob_of("drc")),
        glb(database, blob_of("glb")),
        tags(database, "SELECT " + sound(kSoundTile) + ", drc, glb FROM tiles WHERE level = ? AND y = ? AND x = ?"),
        records(database,
                "SELECT " + sound(kSoundTile) +
                    ", record, y, x FROM tiles WHERE level = ? AND y BETWEEN ? AND ? AND x BETWEEN ? AND ? ORDER BY y, x"),
        nodes(database, "SELECT " + sound(kSoundNode) +
                            ", y, x, error, west, south, east, north, low, high, "
                            "EXISTS(SELECT 1 FROM tiles t WHERE t.level = nodes.level AND t.y = nodes.y AND t.x = nodes.x) "
                            "FROM nodes WHERE level = ? AND y BETWEEN ? AND ? AND x BETWEEN ? AND ? ORDER BY y, x") {
    if (database.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'water'") == 0) return;
    water.emplace(database, "SELECT " + sound(kSoundWater) + ", mask FROM water WHERE level = ? AND y = ? AND x = ?");
  }
  std::string sound(const char* condition) const { return summed ? condition : "1"; }
  std::string blob_of(const std::string& column) const {
    return "SELECT " + sound(kSoundTile) + ", bytes, " + column + ", record FROM tiles LEFT JOIN blobs ON hash = " + column +
           " WHERE level = ? AND y = ? AND x = ?";
  }
  std::mutex mutex;
  std::unique_ptr<Database> opened;
  Database& database = *opened;
  const bool summed;
  Statement drc, glb, tags, records, nodes;
  std::optional<Statement> water;
  std::atomic<std::size_t> cache_bytes{0};  ///< as of its last use
};

}  // namespace cordillera::pipeline
