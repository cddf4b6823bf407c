#pragma once
// One SQLite file a dataset: tiles by address, bytes by content hash (equal tiles are stored once), a block a transaction.
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "pipeline/encode/encode.h"
#include "proto/lattice.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// What a client can fetch of a tile.
enum class Encoding : std::uint8_t { drc, glb };

/// A finished tile on its way into the store.
struct EncodedTile {
  proto::TileRecord record;
  /// Empty of a tile without triangles: its record alone is kept, which says how much data is under none.
  std::string drc;
  std::string glb;  ///< empty, unless a build of store format 1 made it: see tile_glb.h

  bool shows() const { return !drc.empty(); }
};

/// "tile 5/17/23", as messages have it.
std::string name_of(const proto::TileAddress& tile);
inline proto::TileAddress address_of(const proto::TileRecord& record) {
  return {static_cast<int>(record.level()), static_cast<std::int32_t>(record.x()), static_cast<std::int32_t>(record.y())};
}

/// A tile's water mask, as pack_water has it; tiles that are all land have none.
struct TileWater {
  proto::TileAddress tile;
  std::string packed;
};

/// What a block, or the task above all blocks, hands to the store in one transaction.
struct FinishedTask {
  proto::TileAddress node;         ///< the block, or the one that stands for all above
  std::vector<EncodedTile> tiles;  ///< tiles with a triangle, and records of those that lost all their data
  std::optional<std::pair<proto::TileAddress, std::string>> mesh;  ///< what levels above need of it; none when all void
  std::vector<proto::TileAddress> consumed;                        ///< blocks whose meshes are no longer needed
  bool mesh_is_kept = false;                                       ///< in a file, and mesh has its hash: see StoreWriter::keep
  std::vector<TileWater> water = {};                               ///< of a block's tiles on all its levels

  /// Whether one of the tiles has a triangle.
  bool shows() const {
    return std::any_of(tiles.begin(), tiles.end(), [](const EncodedTile& tile) { return tile.shows(); });
  }
};

/// What becomes of another build that is already where a new one is to go.
enum class Existing { replace, refuse };
/// The refusal. what: which build is in the way.
proto::Problem output_exists(const std::string& what);

/// The store while a job writes it. Thread-safe (calls are serialised). Reads that fail (disk gone, file damaged) throw
/// StoreError, here and in StoreReader.
class StoreWriter {
 public:
  /// Creates the file or opens an unfinished one of the same plan; a file of another plan, and one with a damaged manifest, is
  /// started anew or refused. A published one of the same plan has everything finished, and publish gives its manifest again. A
  /// file that is no store is refused, and so is one in use.
  static proto::Result<std::unique_ptr<StoreWriter>> open(const std::string& path, const proto::Plan& plan,
                                                          Existing other = Existing::replace);
  virtual ~StoreWriter() = default;
  virtual bool finished(const proto::TileAddress& node) const = 0;  ///< a committed block or merge
  /// The part of a commit that any thread may do before its turn, several at once: puts the mesh into its file. What fails is
  /// left to commit(). Of a task that is never committed a file stays of which nothing tells.
  virtual void keep(FinishedTask& task) = 0;
  virtual proto::Result<void> commit(const FinishedTask& task) = 0;  ///< all or nothing
  /// A committed block's tiles, without what it has left; none of a published store.
  virtual FinishedTask block(const proto::TileAddress& node) const = 0;
  virtual std::optional<std::string> mesh(const proto::TileAddress& node) const = 0;
  /// The mask of a tile that a committed block made; empty: all land, or the store is published.
  virtual std::string water(const proto::TileAddress& tile) const = 0;
  /// All or nothing; a tile's mask takes the place of an earlier one. Nothing happens to a published store, which has them.
  virtual proto::Result<void> put_water(const std::vector<TileWater>& masks) = 0;
  /// Sums the records up per level into manifest->levels, tiles, triangles, bytes; writes the manifest; only then can StoreReader
  /// open the file. Geometric errors are made not to fall towards the root.
  virtual proto::Result<proto::Manifest> publish(proto::Manifest manifest) = 0;
};

/// Rewrites a published store without blobs that no tile names and without free pages, if it has such. Bytes saved; whoever reads
/// the file keeps the old one. The new one is whole on disk before it takes its place.
proto::Result<std::uint64_t> compact_store(const std::string& path);

/// A node of the tile tree as 3D Tiles sees it: it has triangles itself or tiles below it have.
struct TileExtent {
  proto::TileAddress tile;
  bool content = false;            ///< it has triangles itself
  double geometric_error_m = 0;    ///< greatest stated error of it and all below it
  std::array<double, 6> region{};  ///< as TileRecord::region, of it and all below it
};

struct Blob {
  std::string bytes;
  std::string etag;  ///< content hash, hex, without quotes
};

/// A published dataset. Thread-safe.
class StoreReader {
 public:
  /// Refuses a file that was not published.
  static proto::Result<std::unique_ptr<StoreReader>> open(const std::string& path);
  /// Only the manifest, at a fraction of the cost: for lists of many.
  static proto::Result<proto::Manifest> manifest_of(const std::string& path);
  virtual ~StoreReader() = default;
  virtual const proto::Manifest& manifest() const = 0;
  virtual std::optional<Blob> tile(const proto::TileAddress& tile, Encoding encoding) const = 0;
  /// A tile's .glb with other normals than a vertex's own, which Encoding::glb has.
  virtual std::optional<Blob> glb(const proto::TileAddress& tile, const Shading& shading) const = 0;
  /// The coarsest step that points of a level's .glb tiles are rounded to, on each axis of ECEF; metres. 0: it is not known.
  virtual double glb_step_m(int level) const = 0;
  /// The level whose nodes are the blocks that tiles were made in, see Plan; 0 where it is not known.
  virtual int block_level() const = 0;
  /// A tile's etag alone, without its bytes.
  virtual std::optional<std::string> tag(const proto::TileAddress& tile, Encoding encoding) const = 0;
  /// Memory that reading has taken and keeps, about.
  virtual std::size_t cache_bytes() const = 0;
  /// A tile's water mask, as pack_water has it; empty: all land.
  virtual std::string water(const proto::TileAddress& tile) const = 0;
  virtual std::optional<proto::TileRecord> record(const proto::TileAddress& tile) const = 0;
  /// Every record of a level between x and y bounds (inclusive), ordered by y then x.
  virtual std::vector<proto::TileRecord> records(int level, std::int32_t x0, std::int32_t y0, std::int32_t x1,
                                                 std::int32_t y1) const = 0;
  /// Every record of a level.
  std::vector<proto::TileRecord> records_of(int level) const {
    return records(level, 0, 0, proto::tiles_across(level) - 1, proto::tiles_up(level) - 1);
  }
  /// Every node of a level between bounds (inclusive), ordered by y then x. Unless overridden: those that have records.
  virtual std::vector<TileExtent> extents(int level, std::int32_t x0, std::int32_t y0, std::int32_t x1, std::int32_t y1) const;
};

}  // namespace cordillera::pipeline
