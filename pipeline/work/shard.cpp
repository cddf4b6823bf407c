#include "pipeline/work/shard.h"

#include "pipeline/encode/little_endian.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/work/work_plan.h"
#include "raster/storage/storage.h"

namespace cordillera::pipeline::work {
namespace {

constexpr std::string_view kMagic = "CDshard1";
constexpr std::size_t kHash = 16, kHead = 8 + 8 + 8 + 2 * kHash;

struct Head {
  std::uint64_t mesh = 0, tiles = 0;
  std::string mesh_hash, tiles_hash;
};

std::string place(const proto::WorkTask& task) {
  return std::to_string(task.level()) + "/" + std::to_string(task.x()) + "/" + std::to_string(task.y());
}

proto::Problem missing(const std::string& path, const proto::WorkTask& task) {
  return {"shard-missing", "task " + place(task) + " has not been done: " + path + " does not exist",
          "cordillera work for its stage", ""};
}
/// It goes, so that it no longer counts as done: schedulers leave out stages that are.
proto::Problem damaged(const std::string& path, const proto::WorkTask& task) {
  const std::string removed = raster::remove_file(path) ? ", and was removed" : "";
  return {"shard-damaged", "the result of task " + place(task) + " is damaged" + removed + ": " + path,
          "cordillera work for its stage, which makes it anew", ""};
}

std::optional<Head> head_of(const std::string& bytes) {
  if (bytes.size() < kHead || bytes.compare(0, kMagic.size(), kMagic) != 0) return std::nullopt;
  return Head{little_endian_at<std::uint64_t>(bytes, 8), little_endian_at<std::uint64_t>(bytes, 16), bytes.substr(24, kHash),
              bytes.substr(24 + kHash, kHash)};
}

/// Tiles and water masks; without what was left for the task above.
proto::Result<FinishedTask> tiles_of(std::string_view bytes, const Head& head, const std::string& path,
                                     const proto::WorkTask& task) {
  proto::Shard shard;
  if (content_hash(bytes) != head.tiles_hash || !shard.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) ||
      shard.key() != task.key()) {
    return damaged(path, task);
  }
  FinishedTask finished;
  finished.node = address_of(task);
  for (proto::ShardTile& tile : *shard.mutable_tiles()) {
    finished.tiles.push_back({std::move(*tile.mutable_record()), std::move(*tile.mutable_drc()), std::move(*tile.mutable_glb())});
  }
  for (proto::ShardWater& mask : *shard.mutable_water()) {
    finished.water.push_back(
        {{static_cast<int>(mask.level()), static_cast<std::int32_t>(mask.x()), static_cast<std::int32_t>(mask.y())},
         std::move(*mask.mutable_packed())});
  }
  return finished;
}

proto::Result<Head> read_head(const std::string& path, const proto::WorkTask& task) {
  const auto first = raster::read_range(path, 0, kHead);
  if (!first.ok()) return first.problem();
  if (!*first) return missing(path, task);
  const auto head = head_of(**first);
  if (!head) return damaged(path, task);
  return *head;
}

}  // namespace

std::string shard_path(const std::string& folder, const std::string& key) {
  return folder + "/shards/" + key.substr(0, 2) + "/" + key + ".shard";
}

proto::Result<void> write_shard(const std::string& folder, const proto::WorkTask& task, const FinishedTask& finished) {
  proto::Shard shard;
  shard.set_key(task.key());
  shard.set_level(task.level());
  shard.set_x(task.x());
  shard.set_y(task.y());
  for (const EncodedTile& tile : finished.tiles) {
    proto::ShardTile& out = *shard.add_tiles();
    *out.mutable_record() = tile.record;
    out.set_drc(tile.drc);
    out.set_glb(tile.glb);
  }
  for (const TileWater& mask : finished.water) {
    proto::ShardWater& out = *shard.add_water();
    out.set_level(static_cast<std::uint32_t>(mask.tile.z));
    out.set_x(static_cast<std::uint32_t>(mask.tile.x));
    out.set_y(static_cast<std::uint32_t>(mask.tile.y));
    out.set_packed(mask.packed);
  }
  const std::string mesh = finished.mesh ? finished.mesh->second : "", tiles = shard.SerializeAsString();
  std::string bytes(kMagic);
  append_little_endian(bytes, std::uint64_t{mesh.size()});
  append_little_endian(bytes, std::uint64_t{tiles.size()});
  bytes += content_hash(mesh) + content_hash(tiles) + mesh + tiles;
  return raster::write_whole(shard_path(folder, task.key()), bytes);
}

proto::Result<FinishedTask> read_shard(const std::string& folder, const proto::WorkTask& task) {
  const std::string path = shard_path(folder, task.key());
  const auto bytes = raster::read_whole(path);
  if (!bytes.ok()) return bytes.problem();
  if (!*bytes) return missing(path, task);
  const auto head = head_of(**bytes);
  if (!head || (*bytes)->size() != kHead + head->mesh + head->tiles) return damaged(path, task);
  const std::string mesh = (*bytes)->substr(kHead, head->mesh);
  if (content_hash(mesh) != head->mesh_hash) return damaged(path, task);
  auto finished = tiles_of(std::string_view(**bytes).substr(kHead + head->mesh), *head, path, task);
  if (finished.ok() && !mesh.empty()) finished->mesh = {finished->node, mesh};
  return finished;
}

proto::Result<FinishedTask> read_shard_tiles(const std::string& folder, const proto::WorkTask& task) {
  const std::string path = shard_path(folder, task.key());
  const auto head = read_head(path, task);
  if (!head.ok()) return head.problem();
  const auto tiles = raster::read_range(path, kHead + head->mesh, head->tiles);
  if (!tiles.ok()) return tiles.problem();
  if (!*tiles) return missing(path, task);
  if ((*tiles)->size() != head->tiles) return damaged(path, task);
  return tiles_of(**tiles, *head, path, task);
}

proto::Result<std::optional<std::string>> read_shard_mesh(const std::string& folder, const proto::WorkTask& task) {
  const std::string path = shard_path(folder, task.key());
  const auto head = read_head(path, task);
  if (!head.ok()) return head.problem();
  if (head->mesh == 0) return std::optional<std::string>();
  auto mesh = raster::read_range(path, kHead, head->mesh);
  if (!mesh.ok()) return mesh.problem();
  if (!*mesh || content_hash(**mesh) != head->mesh_hash) return damaged(path, task);
  return mesh;
}

proto::Result<std::set<std::string>> shards_there(const std::string& folder, Shards which) {
  std::set<std::string> paths;
  const std::string shards = folder + "/shards/";
  const bool by_size = which == Shards::done && !raster::is_remote(folder);
  const auto groups = raster::names_in(folder + "/shards");
  if (!groups) return groups.problem();
  for (const std::string& group : *groups) {
    const auto names = raster::names_in(shards + group);
    if (!names) return names.problem();
    for (const std::string& name : *names) {
      const std::string path = shards + group + "/" + name;
      if (name.ends_with(".shard") && (!by_size || raster::size_of(path).value_or(0) >= kHead)) paths.insert(path);
    }
  }
  return paths;
}

}  // namespace cordillera::pipeline::work
