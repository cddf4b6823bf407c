#include "pipeline/exports/export.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "pipeline/exports/export_work.h"
#include "pipeline/exports/folder_page.h"
#include "pipeline/exports/tile_places.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/batches.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/tileset/manifest_json.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kOld = ".old";  // behind kPartial and the process, for as long as two folders change places
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

  /// Before files are written there.
  void make_folder_of(const std::string& name) {
    fs::path folder = (path_ / name).parent_path();
    if (folder == last_folder_) return;
    fs::create_directories(folder);
    last_folder_ = std::move(folder);
  }
  /// By any thread.
  void write(const std::string& name, const std::string& bytes) const {
    const fs::path file = path_ / name;
    std::ofstream out(file, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) throw fs::filesystem_error("write failed", file, std::make_error_code(std::errc::no_space_on_device));
  }

 private:
  fs::path path_, last_folder_;
};

struct File {
  std::string path;
  const faces::Resource* resource = nullptr;
  faces::Place place;
};

void write_faces(const faces::Terrain& terrain, const std::vector<const faces::Face*>& chosen, const exports::ExportWork& work,
                 Workplace& to) {
  exports::ExportProgress progress(work.progress);
  faces::Batches<File> files(
      work.threads, [&](File& file) { to.write(file.path, exports::made(terrain, *file.resource, file.place).bytes); },
      [&](File&) { progress.next(); });
  progress.expect(terrain, [&](const auto& one) {
    for (const faces::Face* face : chosen)
      face->each_path(terrain, {[&](const std::string&) { one(); }, {1, faces::Named::expected}});
  });
  for (const faces::Face* face : chosen) {
    exports::each_named(terrain, *face, work.threads, [&](const std::string& path, const faces::Found& found) {
      to.make_folder_of(path);
      files.add({path, found.resource, found.place});
    });
  }
  files.finish();
  progress.finish();
}

/// They take each other's names in one step. False: their file system cannot.
bool exchange(const fs::path& one, const fs::path& other) {
  return ::renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0;
}

void move_into_place(const Workplace& from, const fs::path& folder) {
  if (!fs::exists(folder) || fs::is_empty(folder)) {
    fs::rename(from.path(), folder);
    return;
  }
  if (exchange(from.path(), folder)) return;  // what was there goes with the workplace
  const fs::path old = from.path().string() + kOld;
  fs::rename(folder, old);
  fs::rename(from.path(), folder);
  fs::remove_all(old);
}

/// What a folder of any faces may hold at its top.
std::set<std::string, std::less<>> names_of_exports() {
  std::set<std::string, std::less<>> names = {"manifest.json", kFolderPage};
  for (const faces::Face* face : faces::all_faces()) {
    for (const faces::Resource& resource : face->resources) names.emplace(resource.path.substr(0, resource.path.find('/')));
  }
  return names;
}

bool is_export(const fs::path& folder) {
  static const std::set<std::string, std::less<>> kNames = names_of_exports();
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (!kNames.contains(entry.path().filename().string())) return false;
  }
  const auto manifest = manifest_of_folder(folder.string());
  return manifest && manifest->levels_size() > 0;
}

}  // namespace

proto::Result<void> check_export_folder(const std::string& folder, Existing other) {
  try {
    const fs::path path(folder);
    if (!fs::exists(path)) return {};
    if (fs::is_directory(path) && fs::is_empty(path)) return {};
    if (fs::is_directory(path) && is_export(path)) {
      if (other == Existing::refuse) return output_exists(folder + " holds an earlier build");
      return {};
    }
    return Problem{"export-folder-in-use", folder + " exists and holds something else", kAccepted, "output"};
  } catch (const fs::filesystem_error& e) { return write_problem(folder, e.code().message()); }
}

proto::Result<void> export_static(const faces::Terrain& terrain, const std::vector<const faces::Face*>& chosen,
                                  const std::string& folder, Existing other, const exports::ExportWork& work) {
  if (const auto usable = check_export_folder(folder, other); !usable) return usable;
  try {
    const fs::path target = (fs::absolute(folder) / "").lexically_normal().parent_path();  // without a slash at the end
    const std::string before = target.filename().string() + exports::kPartial;
    exports::remove_left_behind(target.parent_path(), before, {""});
    // Where nothing has its place, a kill has left the earlier export under that name alone.
    if (fs::exists(target)) exports::remove_left_behind(target.parent_path(), before, {kOld});
    Workplace place(target.string() + exports::kPartial + std::to_string(getpid()));
    write_faces(terrain, chosen, work, place);
    place.write("manifest.json", manifest_json(terrain.manifest()));
    const bool has_page =
        std::any_of(chosen.begin(), chosen.end(), [](const faces::Face* face) { return face->entry == "tileset.json"; });
    if (has_page) place.write(kFolderPage, folder_page(terrain));
    move_into_place(place, target);
    return {};
  } catch (const exports::Refused& refused) { return refused.problem; } catch (const fs::filesystem_error& e) {
    return write_problem(folder, e.code().message());
  } catch (const StoreError& e) { return write_problem(folder, std::string("its store failed: ") + e.what()); }
}

}  // namespace cordillera::pipeline
