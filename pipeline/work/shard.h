#pragma once
// What a task leaves: one file, named by the task's key. Its tiles for publish, its mesh for the task above, a hash of each.
//
//   8 bytes "CDshard1" | 8 bytes length of the mesh | 8 bytes length of the tiles, little-endian | 16 bytes hash of each |
//   mesh (TileMeshRecord; empty where there is none) | tiles (Shard)
#include <optional>
#include <set>
#include <string>

#include "pipeline/store/store.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

/// folder/shards/ab/abcd….shard
std::string shard_path(const std::string& folder, const std::string& key);

/// Written whole or not at all; two writers of one key write the same bytes.
proto::Result<void> write_shard(const std::string& folder, const proto::WorkTask& task, const FinishedTask& finished);

/// Reads, and compares hashes and key. "shard-missing" or "shard-damaged" name the task and the file; a damaged one is removed.
proto::Result<FinishedTask> read_shard(const std::string& folder, const proto::WorkTask& task);
/// The same without the mesh, which is not read, and so not compared: of a large raster it is most of a shard.
proto::Result<FinishedTask> read_shard_tiles(const std::string& folder, const proto::WorkTask& task);
/// Of the shard the mesh alone; nullopt where the task left none.
proto::Result<std::optional<std::string>> read_shard_mesh(const std::string& folder, const proto::WorkTask& task);

/// Paths of shards in the folder, as shard_path has them, by listing it: asking a storage for each shard of a planet would take
/// an hour. done: without those that are shorter than any can be, as a full disk leaves them; in object storage an upload is
/// whole.
enum class Shards { all, done };
proto::Result<std::set<std::string>> shards_there(const std::string& folder, Shards which);

}  // namespace cordillera::pipeline::work
