#pragma once
// What is to become of datasets whose rasters can be changed: for each the changes that were asked for, in a file of its folder.
// A change that is in it is done, after a kill too; one that is not was never answered.
//
//   changes.json         with a sum, pending changes and how the last ones ended: where it or sources/ is, rasters can be changed
//   sources/             rasters of the versions that are there and of pending changes
//   dataset.sqlite       the version that is served; says of which rasters it was made (note kVersionNote)
//   versions/N.sqlite    earlier ones
//   target.json, next.sqlite    the version that is being built
//
// A note or list that is damaged is not an empty one: who took it for that would remove all rasters. Then nothing is removed, and
// nothing is built.
#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/store/store_revise.h"
#include "proto/result.h"
#include "server/data/layout.h"
#include "work.pb.h"

namespace cordillera::server::updates {

using pipeline::kChangesFile;
using pipeline::kVersionNote;
inline constexpr const char* kTargetFile = "target.json";
inline constexpr const char* kNextStore = "next.sqlite";
inline constexpr const char* kSources = "sources";
inline constexpr const char* kVersions = "versions";

/// Whether a row, a record or a list may say that this is a raster in its dataset's folder: one name, in kSources or not. Those
/// of a restored backup may be anybody's.
bool may_be_raster(std::string_view path);
/// Whether rasters of the dataset in the folder can be changed.
bool is_changeable(const std::filesystem::path& folder);
/// Whether a version of it is to be built: a job in the folder builds that.
bool has_target(const std::filesystem::path& folder);
std::filesystem::path kept_store(const std::filesystem::path& folder, std::uint32_t number);
/// Numbers of the other versions that are kept: the one that was served before `served` first, then the one before that. Those
/// that were never before it follow, greatest first.
std::vector<std::uint32_t> kept_numbers(const std::filesystem::path& folder, const proto::DatasetVersion& served = {});
/// What the store of a dataset whose rasters can be changed was made of; nullopt: no such file. Problem: "store-damaged".
proto::Result<std::optional<proto::DatasetVersion>> version_in(const std::filesystem::path& store);

/// Puts the first change of a dataset into a folder that nobody knows of yet.
proto::Result<void> begin(const std::filesystem::path& folder, proto::SourceChange change);

/// What the request asked for that had this key: the hash of it; nullopt: none that is remembered had it.
std::optional<std::string> request_with(const std::string& key, const proto::SourceChanges& changes);
/// Within Ledger::while_idle, whose changes these are.
proto::Result<void> note_rollback(const std::filesystem::path& folder, proto::SourceChanges changes,
                                  const proto::Rollback& rollback);

/// The rasters after a change. Problems: "source-unknown", "source-last".
proto::Result<std::vector<proto::DatasetSource>> applied(std::vector<proto::DatasetSource> sources,
                                                         const proto::SourceChange& change);

/// Thread-safe. Times are UTC. Throws pipeline::StoreError where the list is damaged, or the note of the version that is served;
/// first(), pending() and tidy() do not.
class Ledger {
 public:
  explicit Ledger(Layout layout) : layout_(std::move(layout)) {}

  bool holds(const std::string& id) const { return is_changeable(layout_.dataset(id)); }
  /// A pending change may have a problem: of its last attempt, and there will be another one.
  proto::SourceChanges read(const std::string& id) const;
  /// The version that is served; empty where there is none, and of a dataset of one raster that does not change.
  proto::DatasetVersion current(const std::string& id) const;
  /// What the rasters will be when all that is pending has been done.
  std::vector<proto::DatasetSource> expected(const std::string& id) const;

  /// Gives the change its number and notes it: it is on disk when this returns. bring: puts its raster into the dataset's folder,
  /// if it has one. Problems: those of applied() and of bring, "queue-full" beyond `most` pending ones.
  using Bring = std::function<proto::Result<void>()>;
  proto::Result<proto::SourceChange> add(const std::string& id, proto::SourceChange change, std::size_t most, const Bring& bring);
  /// The one whose turn it is; none where the list is damaged.
  std::optional<proto::SourceChange> first(const std::string& id) const;
  /// How many are still to be done; 0 where the list is damaged.
  std::size_t pending(const std::string& id) const;
  /// Changes of all datasets that are still to be done, without what a dataset began with.
  std::size_t waiting() const;
  /// Something was found out about a pending change.
  proto::Result<void> amend(const std::string& id, const proto::SourceChange& change);
  /// What kept a pending change from being done, which is tried again. Not on the disk: that may be what is full.
  void note_waiting(const std::string& id, const std::string& change, const proto::Problem& problem);
  /// The first change came to its end.
  proto::Result<void> end(const std::string& id, const std::string& change, const std::optional<proto::Problem>& problem);
  /// A raster whose addition was tried in vain and whose removal waits: the one comes to its end with what kept it from being
  /// done, which is told here too, the other is done. nullopt: there is none.
  proto::Result<std::optional<proto::Problem>> take_back(const std::string& id);
  /// Removes what neither a version nor a pending change names; versions/ keeps the first `keep` of kept_numbers(). Where it
  /// cannot be told what they name, no raster goes. What is shown of a first version while it is made stays.
  void tidy(const std::string& id, std::size_t keep);
  /// For who looks at a dataset before it notes a change of it, until that is noted: one request at a time.
  std::unique_lock<std::mutex> alone(const std::string& id) {
    return std::unique_lock(noting_.at(std::hash<std::string>()(id) % noting_.size()));
  }
  /// Runs while no change comes or goes.
  void apart(const std::function<void()>& work);
  /// Runs while no change comes or goes, if none is pending. False: one is.
  bool while_idle(const std::string& id, const std::function<void(const proto::SourceChanges&)>& work);

 private:
  proto::Result<void> change(const std::string& id, const std::function<proto::Result<void>(proto::SourceChanges&)>& edit);

  /// The list of a dataset; what waits in it is looked at by waiting().
  proto::Result<proto::SourceChanges> look(const std::string& id) const;

  Layout layout_;
  std::array<std::mutex, 64> noting_;  ///< shared by datasets, so that none stays of one that is deleted; taken before mutex_
  mutable std::mutex mutex_;
  mutable std::set<std::string> waiting_;  ///< datasets that had pending changes when they were last looked at
  struct Tried {
    std::string change;
    proto::Problem problem;
  };
  mutable std::map<std::string, Tried> tried_;  ///< by dataset; of changes that were tried in vain
};

}  // namespace cordillera::server::updates
