#include "server/datasets/adoption.h"

#include <algorithm>

#include "pipeline/store/store.h"
#include "server/data/folder_lock.h"
#include "server/datasets/data_folder.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/ledger.h"
#include "server/datasets/registry_file.h"
#include "server/datasets/upload.h"
#include "server/http/dataset_id.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// Of datasets as far as one can see; an empty one says nothing.
std::vector<fs::path> dataset_folders(const Layout& layout) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(layout.datasets(), error)) {
    if (!entry.is_directory(error) || !fs::is_empty(entry.path(), error)) folders.push_back(entry.path());
  }
  return folders;
}

/// What its folder says, with the state that it had come to; none: nothing that could be served or built.
std::optional<Dataset> dataset_in(const Layout& layout, const std::string& id) {
  if (!is_id(id)) return std::nullopt;  // no address could name it
  const fs::path folder = layout.dataset(id);
  auto dataset = read_record(folder);
  if (dataset) {
    std::error_code error;
    const bool can_be_built = updates::is_changeable(folder) || !dataset->address.empty() ||
                              (!dataset->raster.empty() && fs::exists(folder / dataset->raster, error));
    const bool built = is_built(layout, *dataset);
    if (!built && !can_be_built) return std::nullopt;
    dataset->state = built ? State::ready : State::queued;
    return dataset;
  }
  // Of an earlier version. Nothing says that everybody might read it, so not everybody may.
  const auto manifest = pipeline::StoreReader::manifest_of(layout.store(id).string());
  if (!manifest) return std::nullopt;
  dataset.emplace();
  dataset->id = id;
  dataset->name = manifest->name();
  dataset->state = State::ready;
  dataset->options = manifest->options();
  dataset->created = now_text();
  dataset->is_private = true;
  return dataset;
}

void set_aside(const Layout& layout, const std::string& id) {
  std::error_code error;
  fs::create_directories(layout.orphans(), error);
  fs::path place = layout.orphans() / id;
  for (int k = 2; fs::exists(place, error); ++k) place = layout.orphans() / (id + "-" + std::to_string(k));
  fs::rename(layout.dataset(id), place, error);
  log_warning(error ? "no dataset can be made of " + layout.dataset(id).string() +
                          ", and it cannot be set aside: " + error.message()
                    : "no dataset can be made of " + layout.dataset(id).string() + ": set aside in " + place.string() +
                          "; cordillera vacuum --orphans removes it");
}

/// The key may be another row's by now.
bool add_row(Registry& registry, Dataset dataset) {
  if (registry.add(dataset)) return true;
  dataset.idempotency_key.clear();
  return registry.add(dataset);
}

bool adopt(const Layout& layout, Registry& registry, const Dataset& dataset) {
  if (!add_row(registry, dataset)) return false;
  const fs::path folder = layout.dataset(dataset.id);
  const bool recorded = read_record(folder).has_value();
  log_warning("dataset " + dataset.id + " was not in the registry: adopted again, " + to_string(dataset.state) +
              (recorded ? "" : ", as a private one of no owner, since its folder has no " + std::string(kRecordFile)));
  if (!recorded && !write_record(folder, dataset))
    log_warning("dataset " + dataset.id + ": " + kRecordFile + " cannot be written");
  return true;
}

/// A name beside it that is free.
fs::path kept_beside(const fs::path& file) {
  std::error_code error;
  fs::path place = file.string() + ".lost";
  for (int k = 2; fs::exists(place, error); ++k) place = file.string() + ".lost-" + std::to_string(k);
  return place;
}

}  // namespace

std::optional<proto::Problem> lost_registry(const Layout& layout) {
  const auto folders = dataset_folders(layout).size();
  if (folders == 0) return std::nullopt;
  std::error_code error;
  std::string what;
  if (!fs::exists(layout.registry(), error)) {
    what = "is missing";
  } else if (fs::file_size(layout.registry(), error) == 0) {  // not to be opened: SQLite would remove the log of an empty file
    what = "is empty";
  } else if (const std::string why = RegistryFile::why_not_ours(layout.registry().string()); !why.empty()) {
    what = "is not the registry of a server: " + why;
  } else {
    return std::nullopt;
  }
  return proto::Problem{
      "data-unusable",
      layout.registry().string() + " " + what + ", and beside it are " + std::to_string(folders) + " folders of datasets",
      "the registry that belongs to them, with its -wal file if it has one; or cordillera adopt " + layout.root.string() +
          ", which makes a new one of what the folders say",
      "--data"};
}

Adopted adopt_folders(const Layout& layout, Registry& registry) {
  Adopted done;
  std::vector<Dataset> found;
  std::error_code error;
  for (const fs::path& folder : dataset_folders(layout)) {
    const std::string id = folder.filename().string();
    if (registry.holds(id)) continue;
    if (is_marked_deleted(folder)) {
      log_info("dataset " + id + " was being deleted: removed");
      if (remove_dataset_folder(layout, id)) log_warning("dataset " + id + ": its folder cannot be removed");
      continue;
    }
    if (auto dataset = dataset_in(layout, id)) {
      found.push_back(std::move(*dataset));
    } else {
      set_aside(layout, id);
      ++done.set_aside;
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Dataset& a, const Dataset& b) { return std::pair(a.created, a.id) < std::pair(b.created, b.id); });
  for (const Dataset& dataset : found) {
    if (adopt(layout, registry, dataset)) ++done.adopted;
  }
  for (const auto& entry : fs::directory_iterator(layout.datasets(), error)) {
    std::error_code kept;
    if (!registry.holds(entry.path().filename().string())) fs::remove(entry.path(), kept);  // empty ones alone go this way
  }
  return done;
}

proto::Result<Adopted> make_registry(const Layout& layout) {
  const auto unusable = [&](const std::string& why, const std::string& accepted) {
    return proto::Problem{"data-unusable", "cannot make a registry in " + layout.root.string() + ": " + why, accepted, "path"};
  };
  std::error_code error;
  if (!fs::is_directory(layout.datasets(), error))
    return unusable("it is no data folder", "the data folder of a server that is stopped");
  const FolderLock lock(layout);
  if (!lock.held()) return unusable(lock.why_not("a server"), "the data folder of a server that is stopped");
  if (!lost_registry(layout))
    return unusable("its registry is not lost", "cordillera serve, which adopts folders without a row at its start");
  const fs::path beside = kept_beside(layout.registry());
  for (const char* suffix : {"", "-wal", "-shm"}) {
    const fs::path file = layout.registry().string() + suffix;
    if (fs::exists(file, error)) fs::rename(file, beside.string() + suffix, error);
    if (error) return unusable(file.string() + " cannot be moved: " + error.message(), "a folder that can be written");
  }
  auto registry = Registry::open(layout.registry().string());
  if (!registry) return registry.problem();
  try {
    return adopt_folders(layout, **registry);
  } catch (const RegistryError& broken) {
    return unusable(broken.what(), "a folder that can be written, on a disk with free space");
  }
}

}  // namespace cordillera::server
