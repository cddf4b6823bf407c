// cordillera adopt, vacuum, backup and restore.
#include <iostream>

#include "server/cli/commands.h"
#include "server/datasets/adoption.h"
#include "server/datasets/data_folder.h"

namespace cordillera::server {
namespace {

std::string counted(const BackedUp& done) {
  return std::to_string(done.ready) + " datasets with their tiles, " + std::to_string(done.waiting) + " still to be built";
}

void say(Verbosity words, const std::string& folder, const std::string& what) {
  if (words == Verbosity::all) std::cout << folder << ": " << what << "\n";
}

}  // namespace

int adopt_command(const std::string& data) {
  const auto done = make_registry(Layout{data});
  if (!done) return fail(done.problem());
  std::cout << data << ": " << done->adopted << " datasets in a new registry, " << done->set_aside << " folders set aside\n";
  return kDone;
}

int vacuum_command(const std::string& data, Orphans orphans, Verbosity words) {
  const auto done = vacuum(Layout{data}, orphans);
  if (!done) return fail(done.problem());
  say(words, data,
      std::to_string(done->files) + " files and folders removed, " + std::to_string(done->stores) + " stores rewritten, " +
          std::to_string(done->bytes) + " bytes less");
  if (done->orphans > 0)
    say(words, data, std::to_string(done->orphans) + " folders in orphans/ are no datasets; vacuum --orphans removes them");
  if (done->unchanged.empty()) return kDone;
  std::string why;
  for (const std::string& one : done->unchanged) why += (why.empty() ? "" : "; ") + one;
  return fail({"store-write", "the rest is done, but " + why,
               "sound stores on a disk with room for a second one; cordillera check says what is damaged", "path"});
}

int backup_command(const std::string& data, const std::string& output, Verbosity words) {
  if (output.empty()) return wrong_usage({"usage", "backup needs to know where to write", "-o FOLDER", "--output"});
  const auto done = backup(Layout{data}, output);
  if (!done) return fail(done.problem());
  say(words, output, counted(*done));
  if (done->damaged.empty()) return kDone;
  std::string names;
  for (const std::string& id : done->damaged) names += (names.empty() ? "" : ", ") + id;
  return fail({"store-damaged",
               "the backup is there, but of these datasets the tiles are damaged, in " + data + " as in it: " + names,
               "an earlier backup of them, or posting their rasters again; cordillera check says what is damaged", "path"});
}

int restore_command(const std::string& from, const std::string& data, Verbosity words) {
  const auto done = restore(from, Layout{data});
  if (!done) return fail(done.problem());
  say(words, data, counted(*done));
  return kDone;
}

}  // namespace cordillera::server
