#include <fstream>
#include <set>

#include "raster/disk/write_all.h"
#include "server/datasets/adoption.h"
#include "server/datasets/data_folder.h"
#include "server/datasets/ledger.h"
#include "server/datasets/registry.h"
#include "server/datasets/upload.h"
#include "server/http/digest.h"
#include "server/http/json.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kList = "backup.json";  // what was copied, with hashes; the last file that is written
constexpr int kMostTries = 5;                 // a dataset may change its state while it is copied

proto::Problem cannot(const std::string& what, const std::string& why) {
  return {"backup-failed", what + ": " + why, "a folder that does not exist yet, on a disk with free space", "--output"};
}

/// A file copied to disk, and its hash; none if it cannot be read any more. Throws filesystem_error where it cannot be written.
std::optional<std::string> copied_file(const fs::path& from, const fs::path& to) {
  std::ifstream in(from, std::ios::binary);
  if (!in) return std::nullopt;
  std::ofstream out(to, std::ios::binary);
  auto digest =
      digest_of(in, [&](std::string_view piece) { out.write(piece.data(), static_cast<std::streamsize>(piece.size())); });
  out.close();
  if (!out || !raster::sync_path(to.string()))
    throw fs::filesystem_error("cannot write", to, std::error_code(errno, std::generic_category()));
  return digest;
}

/// Copies datasets one after the other, each as it is when its turn comes.
class Copy {
 public:
  Copy(const Layout& from, Layout to, Registry& live) : from_(from), to_(std::move(to)), live_(live) {}

  /// State of the dataset in the copy: none if it is gone.
  std::optional<State> dataset(const std::string& id) {
    for (int attempt = 0; attempt < kMostTries; ++attempt) {
      const auto now = live_.find(id);
      if (!now) return std::nullopt;
      if (now->state == State::failed) return State::failed;
      const bool ready = now->state == State::ready;
      if (!ready && comes_again(*now)) {  // and asleep until somebody reads it
        ++done_.waiting;
        return State::running;
      }
      fs::create_directories(to_.dataset(id));
      if (copy_all(id, names_of(id, ready, now->raster))) {
        ready ? ++done_.ready : ++done_.waiting;
        return ready ? State::ready : State::queued;
      }
      fs::remove_all(to_.dataset(id));  // it has become ready or was deleted meanwhile: look again
    }
    return std::nullopt;
  }
  void note(const std::string& file, const std::string& hash) { files_[file] = hash; }
  const Json& files() const { return files_; }
  const BackedUp& done() const { return done_; }

 private:
  /// A raster that has an address is fetched again where it is not there, or there in parts, or a list of some.
  bool comes_again(const Dataset& dataset) const {
    const fs::path raster = from_.dataset(dataset.id) / dataset.raster;
    std::error_code gone;
    const bool in_parts = fs::exists(map_of(raster), gone) || fs::exists(raster.parent_path() / kRasters, gone);
    return !dataset.address.empty() && (in_parts || !fs::exists(raster, gone));
  }
  /// What another server needs to go on with the dataset. Of one whose rasters can be changed those too, and the changes that are
  /// pending; first the changes, for what is done of them meanwhile is found to be done.
  std::vector<fs::path> names_of(const std::string& id, bool ready, const std::string& raster) const {
    const fs::path folder = from_.dataset(id);
    if (!updates::is_changeable(folder)) return {ready ? fs::path(kStoreFile) : fs::path(raster)};
    std::vector<fs::path> names;
    std::error_code gone;
    if (fs::exists(folder / updates::kChangesFile, gone)) names.emplace_back(updates::kChangesFile);
    if (ready) names.emplace_back(kStoreFile);
    for (const auto& entry : fs::directory_iterator(folder / updates::kSources, gone))
      names.push_back(fs::path(updates::kSources) / entry.path().filename());
    return names;
  }
  bool copy_all(const std::string& id, const std::vector<fs::path>& names) {
    Json copied = Json::object();
    for (const fs::path& name : names) {
      const fs::path to = to_.dataset(id) / name;
      fs::create_directories(to.parent_path());
      const auto hash = copied_file(from_.dataset(id) / name, to);
      if (!hash) return false;
      copied["datasets/" + id + "/" + name.string()] = *hash;
    }
    files_.update(copied);
    return true;
  }

  const Layout& from_;
  Layout to_;
  Registry& live_;
  Json files_ = Json::object();
  BackedUp done_;
};

void write_list(const fs::path& folder, const Json& files) {
  std::ofstream out(folder / kList);
  out << Json{{"program", std::string("cordillera ") + CORDILLERA_VERSION}, {"data_version", kDataVersion}, {"files", files}}
             .dump(2)
      << "\n";
  out.close();
  if (!out || !raster::sync_path(folder))
    throw fs::filesystem_error("cannot write", folder / kList, std::error_code(errno, std::generic_category()));
}

void sync_tree(const fs::path& folder) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) raster::sync_path(entry.path());
  }
  raster::sync_path(folder);
}

BackedUp copy_into(const Layout& layout, const fs::path& work) {
  const Layout to{work};
  fs::create_directories(to.datasets());
  fs::create_directories(to.incoming());
  Registry::copy(layout.registry().string(), to.registry().string());
  auto live = Registry::read_only(layout.registry().string());
  auto copied = Registry::open(to.registry().string());
  if (!copied) throw RegistryError(copied.problem().detail);
  Copy copy(layout, to, *live);
  for (const Row& row : (*copied)->list()) {
    const auto state = copy.dataset(row->id);
    if (!state) {
      (*copied)->remove(row->id);
    } else if (*state != row->state) {
      (*copied)->set_state(row->id, *state, std::nullopt);
    }
  }
  (*copied)->compact();
  copied->reset();  // closed, so that its log is folded in
  copy.note("registry.sqlite", digest_of_file(to.registry()));
  sync_tree(work);
  write_list(work, copy.files());
  return copy.done();
}

/// A name beside `to`, which is given away only when everything is there.
proto::Result<BackedUp> in_place(const fs::path& to, const std::function<BackedUp(const fs::path& work)>& make) {
  std::error_code error;
  fs::path place = fs::absolute(to).lexically_normal();
  if (!place.has_filename()) place = place.parent_path();
  if (fs::exists(place, error) && !(fs::is_directory(place, error) && fs::is_empty(place, error)))
    return cannot(place.string(), "it exists");
  const fs::path work = place.string() + ".partial-" + std::to_string(getpid());
  try {
    fs::create_directories(work);
    const BackedUp done = make(work);
    if (!raster::put_in_place(work, place))
      throw fs::filesystem_error("cannot write", place, std::error_code(errno, std::generic_category()));
    return done;
  } catch (const std::exception& failed) {
    fs::remove_all(work, error);
    return cannot(place.string(), failed.what());
  }
}

}  // namespace

proto::Result<BackedUp> backup(const Layout& layout, const fs::path& to) {
  std::error_code error;
  if (!fs::exists(layout.registry(), error)) {
    return proto::Problem{"data-unusable", layout.root.string() + " is no data folder",
                          "the folder that a server was given with --data", "path"};
  }
  if (auto lost = lost_registry(layout)) return *lost;  // a backup of nothing would take the place of a good one
  return in_place(to, [&](const fs::path& work) { return copy_into(layout, work); });
}

proto::Result<BackedUp> restore(const fs::path& from, const Layout& layout) {
  std::ifstream in(from / kList);
  const Json list = Json::parse(in, nullptr, false);
  if (list.is_discarded() || !list.contains("files") || !list["files"].is_object()) {
    return proto::Problem{"data-unusable", from.string() + " is no backup: it has no " + kList,
                          "a folder that cordillera backup wrote", "path"};
  }
  if (list.value("data_version", 0) > kDataVersion) {
    return proto::Problem{"data-version", from.string() + " was made by a later version of the program",
                          "that version, or a later one", "path"};
  }
  return in_place(layout.root, [&](const fs::path& work) {
    const Layout to{work};
    fs::create_directories(to.incoming());
    fs::create_directories(to.datasets());
    BackedUp done;
    std::set<fs::path> folders;  // of datasets
    for (const auto& [name, hash] : list["files"].items()) {
      const fs::path file = fs::path(name).lexically_normal();
      if (file.is_absolute() || *file.begin() == "..") throw std::runtime_error("the list names " + name);
      fs::create_directories((work / file).parent_path());
      const auto copied = copied_file(from / file, work / file);
      if (!copied || *copied != hash.get<std::string>())
        throw std::runtime_error(name + " is missing from the backup, or is not what was backed up");
      if (file.filename() == kStoreFile) ++done.ready;
      if (file.has_parent_path()) folders.insert(*std::next(file.begin()));
    }
    done.waiting = folders.size() - done.ready;
    sync_tree(work);
    return done;
  });
}

}  // namespace cordillera::server
