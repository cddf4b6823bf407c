#pragma once
// The tables of a dataset's file.
//
// - meta: 'plan' while the file is written and after, 'manifest' once it is published (nothing else says that it is), and notes
//   (store_revise.h).
// - tiles: a row a tile that has triangles. drc names a row of blobs. glb is empty, as tile_glb makes it; in rows of format 1 it
//   names one too.
// - blobs: bytes by content hash.
// - tasks: committed ones. Only while the file is written; kept, whole, in a store that will be built on.
// - meshes: what waits for the levels above, as hashes of files (mesh_files.h). Kept as tasks are.
// - water: water masks by tile, only of datasets that have any.
// - lost: a record of each tile that has data and no triangle, for what is counted of a level. Not in stores of earlier
//   versions.
// - nodes: a row a tile that has triangles itself or below it, with the region and the error of it all. Made when published.
//
// Rows are addressed by content or by place, so what they hold does not depend on the order of commits.
//
// `sum` is row_sum (sqlite.h) of what else a reader takes from the row: a disk that gives back other bytes, or a row in another's
// place, is seen when the row is read. Stores of earlier versions have none.

namespace cordillera::pipeline {

inline constexpr int kApplicationId = 0x43446C72;  ///< "CDlr"
inline constexpr int kSchemaVersion = 2;           ///< of stores that are written
inline constexpr int kOldestSchema = 1;            ///< still read, continued and updated; both encodings are stored there

inline constexpr const char* kCreateTables = R"(
CREATE TABLE meta(key TEXT PRIMARY KEY, value BLOB NOT NULL, sum INT) WITHOUT ROWID;
CREATE TABLE tiles(level INT, y INT, x INT, record BLOB NOT NULL, drc BLOB NOT NULL, glb BLOB NOT NULL, error REAL NOT NULL,
  west REAL, south REAL, east REAL, north REAL, low REAL, high REAL, sum INT, PRIMARY KEY(level, y, x)) WITHOUT ROWID;
CREATE TABLE blobs(id INTEGER PRIMARY KEY, hash BLOB NOT NULL UNIQUE, bytes BLOB NOT NULL);
CREATE TABLE tasks(level INT, y INT, x INT, PRIMARY KEY(level, y, x)) WITHOUT ROWID;
CREATE TABLE meshes(id INTEGER PRIMARY KEY, level INT, y INT, x INT, bytes BLOB NOT NULL, UNIQUE(level, y, x));
)";

inline constexpr const char* kCreateWater =
    "CREATE TABLE IF NOT EXISTS water(level INT, y INT, x INT, mask BLOB NOT NULL, sum INT, PRIMARY KEY(level, y, x)) WITHOUT "
    "ROWID";

inline constexpr const char* kCreateLost =
    "CREATE TABLE IF NOT EXISTS lost(level INT, y INT, x INT, record BLOB NOT NULL, PRIMARY KEY(level, y, x)) WITHOUT ROWID";

inline constexpr const char* kPutLost = "INSERT OR REPLACE INTO lost(level, y, x, record) VALUES(?, ?, ?, ?)";

inline constexpr const char* kPutTile =
    "INSERT OR REPLACE INTO tiles(level, y, x, record, drc, glb, error, west, south, east, north, low, high, sum) "
    "VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, row_sum(?1, ?2, ?3, ?4, ?5, ?6))";

inline constexpr const char* kPutMeta =
    "INSERT OR REPLACE INTO meta(key, value, sum) VALUES(CAST(?1 AS TEXT), ?2, row_sum(CAST(?1 AS TEXT), ?2))";

// Whether a row is as it was written, for a SELECT.
inline constexpr const char* kSoundMeta = "sum IS row_sum(key, value)";
inline constexpr const char* kSoundTile = "sum IS row_sum(level, y, x, record, drc, glb)";
inline constexpr const char* kSoundWater = "sum IS row_sum(level, y, x, mask)";
inline constexpr const char* kSoundNode = "sum IS row_sum(level, y, x, error, west, south, east, north, low, high)";

inline constexpr const char* kCreateNodes = R"(
CREATE TABLE nodes(level INT, y INT, x INT, error REAL,
  west REAL, south REAL, east REAL, north REAL, low REAL, high REAL, sum INT,
  PRIMARY KEY(level, y, x)) WITHOUT ROWID;
)";

/// Level ?1 of nodes: its own tiles, and its children together.
inline constexpr const char* kFillNodes = R"(
INSERT INTO nodes
SELECT ?1, y, x, max(error), min(west), min(south), max(east), max(north), min(low), max(high),
  row_sum(?1, y, x, max(error), min(west), min(south), max(east), max(north), min(low), max(high)) FROM (
  SELECT y, x, error, west, south, east, north, low, high FROM tiles WHERE level = ?1
  UNION ALL
  SELECT y >> 1 AS y, x >> 1 AS x, error, west, south, east, north, low, high FROM nodes WHERE level = ?1 + 1)
GROUP BY y, x
)";

}  // namespace cordillera::pipeline
