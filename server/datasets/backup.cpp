#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <stdexcept>
#include <vector>

#include "pipeline/check/check.h"
#include "pipeline/exports/whole_file.h"
#include "proto/files.h"
#include "proto/paths.h"
#include "raster/disk/write_all.h"
#include "raster/storage/storage.h"
#include "server/data/folder_lock.h"
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

/// Who restores a backup cannot mend it by another place.
class DamagedBackup : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

proto::Problem cannot(const std::string& what, const std::string& why) {
  return {"backup-failed", what + ": " + why, "a folder that does not exist yet or is empty, on a disk with free space",
          "--output"};
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
        if (ready) look_for_damage(id);
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
  /// In the copy, whose bytes are those that were just read.
  void look_for_damage(const std::string& id) {
    const auto report = pipeline::check::check_bytes(to_.store(id).string());
    if (!report || !report->sound()) done_.damaged.push_back(id);
  }
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

/// Returns, beside the registry, which of its datasets came of the live folder's files, as both were at one moment: a dataset
/// that only one of them has would be made a second time, or never again.
std::optional<std::string> copy_registry(const Layout& from, const Layout& to) {
  for (int attempt = 1;; ++attempt) {
    auto notes = proto::bytes_of_file(from.live());
    Registry::copy(from.registry().string(), to.registry().string());
    if (attempt == kMostTries || proto::bytes_of_file(from.live()) == notes) return notes;
    fs::remove(to.registry());
  }
}

BackedUp copy_into(const Layout& layout, const fs::path& work) {
  const Layout to{work};
  fs::create_directories(to.datasets());
  fs::create_directories(to.incoming());
  const auto notes = copy_registry(layout, to);
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
  if (notes) {
    if (const auto kept = raster::write_whole(to.live().string(), *notes); !kept) throw std::runtime_error(kept.problem().detail);
    copy.note(to.live().filename().string(), digest(*notes));
  }
  sync_tree(work);
  write_list(work, copy.files());
  return copy.done();
}

/// Into a folder that is there, such as one where a disk is mounted, which takes no other's name. What makes it a data folder or
/// a backup comes last, so one that is cut short is neither.
void move_into(const fs::path& work, const fs::path& place) {
  const std::vector<fs::path> last = {Layout{work}.registry(), work / kList};
  std::vector<fs::path> all;
  for (const auto& entry : fs::directory_iterator(work)) {
    if (std::ranges::find(last, entry.path()) == last.end()) all.push_back(entry.path());
  }
  for (const fs::path& file : last) {
    if (fs::exists(file)) all.push_back(file);
  }
  for (const fs::path& from : all) {
    if (!raster::put_in_place(from, place / from.filename()))
      throw fs::filesystem_error("cannot write", place / from.filename(), std::error_code(errno, std::generic_category()));
  }
  fs::remove(work);
}

/// The name of something in a folder that is to be filled; none: it is as good as empty.
std::optional<std::string> something_in(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename() != kLostAndFound) return entry.path().filename().string();
  }
  return std::nullopt;
}

/// Somewhere beside `to`, or in it if it is there. It is given away only when everything is there.
proto::Result<BackedUp> in_place(const fs::path& to, const std::function<BackedUp(const fs::path& work)>& make) {
  std::error_code error;
  const fs::path place = proto::place_of(to);
  const bool there = fs::exists(place, error);
  if (there && !fs::is_directory(place, error)) return cannot(place.string(), "it exists and is no folder");
  const fs::path parent = there ? place : place.parent_path();
  const std::string before = (there ? "" : place.filename().string()) + pipeline::exports::kPartial;
  pipeline::exports::remove_left_behind(parent, before, {""});
  const fs::path work = parent / (before + std::to_string(getpid()));
  try {
    if (const auto other = there ? something_in(place) : std::nullopt) return cannot(place.string(), "it exists, with " + *other);
    fs::create_directories(work);
    const BackedUp done = make(work);
    if (there)
      move_into(work, place);
    else if (!raster::put_in_place(work, place))
      throw fs::filesystem_error("cannot write", place, std::error_code(errno, std::generic_category()));
    return done;
  } catch (const DamagedBackup& damaged) {
    fs::remove_all(work, error);
    return proto::Problem{"backup-failed", damaged.what(), "a backup whose files are as they were written", "path"};
  } catch (const std::exception& failed) {
    fs::remove_all(work, error);
    return cannot(place.string(), failed.what());
  }
}

/// What is copied must not lie in what it is copied from.
std::optional<proto::Problem> refuse_inside(const fs::path& place, const fs::path& from) {
  std::error_code error;
  const fs::path inner = fs::weakly_canonical(place, error), outer = fs::weakly_canonical(from, error);
  if (error || !proto::lies_in(inner, outer)) return std::nullopt;
  return cannot(place.string(), "it lies in " + from.string() + ", which is copied");
}

}  // namespace

proto::Result<BackedUp> backup(const Layout& layout, const fs::path& to) {
  std::error_code error;
  if (!fs::exists(layout.registry(), error)) {
    return proto::Problem{"data-unusable", layout.root.string() + " is no data folder",
                          "the folder that a server was given with --data", "path"};
  }
  if (auto lost = lost_registry(layout)) return *lost;  // a backup of nothing would take the place of a good one
  if (auto refused = refuse_inside(to, layout.root)) return *refused;
  return in_place(to, [&](const fs::path& work) { return copy_into(layout, work); });
}

proto::Result<BackedUp> restore(const fs::path& from, const Layout& layout) {
  std::ifstream in(from / kList);
  const Json list = Json::parse(in, nullptr, false);
  if (list.is_discarded() || !list.contains("files") || !list["files"].is_object()) {
    return proto::Problem{"data-unusable", from.string() + " is no backup: it has no " + kList,
                          "a folder that cordillera backup wrote", "path"};
  }
  const Json version = list.value("data_version", Json(0));
  const bool has_hashes =
      std::all_of(list["files"].begin(), list["files"].end(), [](const Json& hash) { return hash.is_string(); });
  if (!version.is_number_integer() || !has_hashes) {
    return proto::Problem{"data-unusable",
                          from.string() + " is no backup: its " + kList + " is not as cordillera backup writes it",
                          "a folder that cordillera backup wrote", "path"};
  }
  if (version > kDataVersion) {
    return proto::Problem{"data-version", from.string() + " was made by a later version of the program",
                          "that version, or a later one", "path"};
  }
  if (auto refused = refuse_inside(layout.root, from)) return *refused;
  return in_place(layout.root, [&](const fs::path& work) {
    const Layout to{work};
    fs::create_directories(to.incoming());
    fs::create_directories(to.datasets());
    BackedUp done;
    std::set<fs::path> folders;  // of datasets
    for (const auto& [name, hash] : list["files"].items()) {
      const fs::path file = fs::path(name).lexically_normal();
      if (file.is_absolute() || *file.begin() == "..") throw DamagedBackup(from.string() + ": its list names " + name);
      fs::create_directories((work / file).parent_path());
      const auto copied = copied_file(from / file, work / file);
      if (!copied || *copied != hash.get<std::string>())
        throw DamagedBackup(from.string() + ": " + name + " is missing from the backup, or is not what was backed up");
      if (file.filename() == kStoreFile) ++done.ready;
      if (file.has_parent_path()) folders.insert(*std::next(file.begin()));
    }
    done.waiting = folders.size() - done.ready;
    sync_tree(work);
    return done;
  });
}

}  // namespace cordillera::server
