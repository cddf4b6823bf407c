#pragma once
// Stores that are built on: a published one that kept the meshes of its tasks is copied, loses what has changed, and is finished
// anew.
#include <optional>
#include <string>
#include <vector>

#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// Texts that a store carries for whoever builds on it, by key. A store with the note kTasksNote keeps the meshes of all its
/// tasks when it is published.
inline constexpr const char* kTasksNote = "tasks";
/// The note in a store whose rasters can be changed, of which ones it was made. The list of changes lies beside such a store.
inline constexpr const char* kVersionNote = "version";
inline constexpr const char* kChangesFile = "changes.json";

/// nullopt: no such file or note, or one that is not as it was written. The store may be unfinished; nobody writes it meanwhile.
std::optional<std::string> note_in(const std::string& store_path, const std::string& key);
/// For who must not take damage for none. nullopt: no such file or note. Throws StoreError where the file cannot be read, or the
/// note is not as it was written.
std::optional<std::string> sound_note_in(const std::string& store_path, const std::string& key);

/// What is said of a store that cannot be written.
proto::Problem store_write_problem(const std::string& path, const std::string& why);

struct Note {
  std::string key, text;
};

/// What the next build has to do with the tasks of the last one.
struct Revision {
  std::vector<proto::TileAddress> stale;     ///< of the last build: their tiles and meshes go
  std::vector<proto::TileAddress> finished;  ///< of the next build: nothing to do
  int block_level = 0, finest_level = 0;     ///< of both
};

/// A copy of a published store at `to`, as an unfinished store of the plan, for StoreWriter::open. Shares the disk's blocks with
/// the original where the file system can. `to` is there when all is done, or not at all.
proto::Result<void> revise_store(const std::string& from, const std::string& to, const proto::Plan& plan,
                                 const Revision& revision);

/// Creates the unfinished store of the plan if there is none, and puts notes into it. One of another plan is begun anew.
proto::Result<void> begin_store(const std::string& path, const proto::Plan& plan, const std::vector<Note>& notes);

}  // namespace cordillera::pipeline
