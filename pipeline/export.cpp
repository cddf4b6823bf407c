#include "pipeline/export.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "pipeline/manifest_json.h"
#include "pipeline/sqlite.h"
#include "pipeline/subtree.h"
#include "pipeline/tile_path.h"
#include "pipeline/tileset.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kAccepted = "a folder that is missing, empty or an earlier export, on a disk with free space";

Problem write_problem(const std::string& folder, const std::string& why) {
  return {"export-write", "the folder " + folder + " cannot be written: " + why, kAccepted, "output"};
}

// The temporary sibling; removed unless it was moved into place.
class Workplace {
 public:
  explicit Workplace(fs::path path) : path_(std::move(path)) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Workplace() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;
  const fs::path& path() const { return path_; }

  void write(const std::string& name, const std::string& bytes) {
    const fs::path file = path_ / name;
    if (file.parent_path() != last_folder_) {
      fs::create_directories(file.parent_path());
      last_folder_ = file.parent_path();
    }
    std::ofstream out(file, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) throw fs::filesystem_error("write failed", file, std::make_error_code(std::errc::no_space_on_device));
  }

 private:
  fs::path path_, last_folder_;
};

void write_face(const StoreReader& store, const proto::TileAddress& tile, Face face, Workplace& to) {
  const auto blob = store.tile(tile, face);
  if (!blob) throw StoreError("the bytes of tile " + drc_path(tile) + " are missing");
  to.write(face == Face::drc ? drc_path(tile) : glb_path(tile), blob->bytes);
}

// A row of tiles at a time, so that memory does not grow with the level.
void write_level(const StoreReader& store, int level, Workplace& to) {
  const std::int32_t last_x = proto::tiles_across(level) - 1;
  const auto column = store.extents(0, 0, 0, 1, 0);
  std::vector<proto::TileAddress> rows = {};
  for (const TileExtent& root : column) rows.push_back(root.tile);
  for (std::int32_t y = 0; y < proto::tiles_up(level); ++y) {
    for (const TileExtent& node : store.extents(level, 0, y, last_x, y)) {
      if (node.content) {
        write_face(store, node.tile, Face::drc, to);
        write_face(store, node.tile, Face::glb, to);
      }
      if (level % kSubtreeLevels != 0) continue;
      const auto bytes = subtree(store, hemisphere_of(node.tile), level, implicit_x(node.tile), node.tile.y);
      if (bytes) to.write(subtree_path(node.tile), *bytes);
    }
  }
}

void move_into_place(const Workplace& from, const fs::path& folder) {
  if (!fs::exists(folder) || fs::is_empty(folder)) {
    fs::rename(from.path(), folder);
    return;
  }
  const fs::path old = from.path().string() + ".old";
  fs::rename(folder, old);
  fs::rename(from.path(), folder);
  fs::remove_all(old);
}

bool is_export(const fs::path& folder) {
  static const std::set<std::string> kNames = {"manifest.json", "tileset.json", "tiles", "subtrees"};
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!kNames.contains(entry.path().filename().string())) return false;
  }
  std::ifstream in(folder / "manifest.json", std::ios::binary);
  const std::string json((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto manifest = parse_manifest_json(json);
  return manifest && manifest->levels_size() > 0;
}

}  // namespace

proto::Result<void> check_export_folder(const std::string& folder) {
  try {
    const fs::path path(folder);
    if (!fs::exists(path)) return {};
    if (fs::is_directory(path) && (fs::is_empty(path) || is_export(path))) return {};
    return Problem{"export-folder-in-use", folder + " exists and holds something else", kAccepted, "output"};
  } catch (const fs::filesystem_error& e) {
    return write_problem(folder, e.code().message());
  }
}

proto::Result<void> export_static(const StoreReader& store, const std::string& folder) {
  if (const auto usable = check_export_folder(folder); !usable) return usable;
  try {
    const fs::path target = (fs::path(folder) / "").lexically_normal().parent_path();  // without a slash at the end
    Workplace work(target.string() + ".partial-" + std::to_string(getpid()));
    for (int level = 0; level <= static_cast<int>(store.manifest().max_level()); ++level) write_level(store, level, work);
    work.write("tileset.json", tileset_json(store));
    work.write("manifest.json", manifest_json(store.manifest()));
    move_into_place(work, target);
    return {};
  } catch (const fs::filesystem_error& e) {
    return write_problem(folder, e.code().message());
  } catch (const StoreError& e) {
    return write_problem(folder, std::string("its store failed: ") + e.what());
  }
}

}  // namespace cordillera::pipeline
