#include <unistd.h>

#include "pipeline/store/store.h"
#include "server/data/folder_lock.h"
#include "server/datasets/adoption.h"
#include "server/datasets/data_folder.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/ledger.h"
#include "server/datasets/registry.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

std::uintmax_t bytes_below(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) {
    const auto size = fs::file_size(path, ignored);
    return ignored ? 0 : size;
  }
  std::uintmax_t sum = 0;
  fs::recursive_directory_iterator at(path, ignored);
  for (; !ignored && at != end(at); at.increment(ignored)) sum += at->is_regular_file(ignored) ? at->file_size(ignored) : 0;
  return sum;
}

void remove(const fs::path& path, Vacuumed& done) {
  const auto bytes = bytes_below(path);
  std::error_code error;
  fs::remove_all(path, error);
  if (error) return;
  ++done.files;
  done.bytes += bytes;
}

/// In a ready dataset's folder nothing but its store and its record is asked for again.
void clean_dataset(const fs::path& folder, Vacuumed& done) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().filename() != kStoreFile && !is_record(entry.path().filename())) remove(entry.path(), done);
  }
}

}  // namespace

proto::Result<Vacuumed> vacuum(const Layout& layout, Orphans orphans) {
  const auto unusable = [&](const std::string& why) {
    return proto::Problem{"data-unusable", "cannot vacuum " + layout.root.string() + ": " + why,
                          "the data folder of a server that is stopped", "path"};
  };
  std::error_code error;
  if (!fs::exists(layout.registry(), error)) return unusable("it is no data folder");
  const FolderLock lock(layout);
  if (!lock.held()) return unusable(lock.why_not("a server"));
  if (auto lost = lost_registry(layout)) return *lost;
  auto registry = Registry::open(layout.registry().string());
  if (!registry) return registry.problem();
  Vacuumed done;
  try {
    adopt_folders(layout, **registry);
    for (const fs::path& folder :
         {layout.incoming(), layout.removed(), layout.archives(), orphans == Orphans::remove ? layout.orphans() : fs::path()}) {
      for (const auto& entry : fs::directory_iterator(folder, error)) remove(entry.path(), done);
    }
    for (const auto& entry : fs::directory_iterator(layout.orphans(), error)) done.orphans += entry.exists() ? 1 : 0;
    for (const auto& entry : fs::directory_iterator(layout.datasets(), error)) {
      const auto dataset = (*registry)->find(entry.path().filename().string());
      if (!dataset) continue;
      const bool deleted = is_marked_deleted(entry.path());
      if (deleted) (*registry)->remove(dataset->id);
      if (deleted || dataset->state == State::failed) {
        remove(entry.path(), done);
      } else if (dataset->state == State::ready) {
        // One that changes keeps its rasters and earlier versions; the server tidies those.
        if (!updates::is_changeable(entry.path())) clean_dataset(entry.path(), done);
        const fs::path store = layout.store(dataset->id);
        const auto saved = pipeline::compact_store(store.string());
        if (!saved) {
          done.unchanged.push_back(saved.problem().detail);
          continue;
        }
        done.stores += *saved > 0 ? 1 : 0;
        done.bytes += *saved;
      }
    }
    const auto before = bytes_below(layout.registry());
    (*registry)->compact();
    const auto after = bytes_below(layout.registry());
    done.bytes += before > after ? before - after : 0;
  } catch (const RegistryError& broken) { return unusable(broken.what()); }
  return done;
}

}  // namespace cordillera::server
