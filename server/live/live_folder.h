#pragma once
// A folder whose rasters are datasets without a POST: found, changed and gone while the service runs.
#include <condition_variable>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/datasets/upload.h"
#include "server/live/live_notes.h"
#include "server/live/side_files.h"
#include "server/service/service.h"

namespace cordillera::server {

/// Looks every few seconds. Each file with a raster's extension, in the folder and below it, becomes a dataset as a POST with
/// updates=1 would make it, with the service's default options; its id is made of the file's path. A file that has changed is a
/// new version of its dataset; the one before is served until that is built. A file that is gone takes its dataset with it. What
/// somebody deletes stays away until its file changes.
class LiveFolder {
 public:
  /// The service outlives this. notes: as read_live_notes has them.
  LiveFolder(Service& service, std::filesystem::path folder, LiveNotes notes);
  ~LiveFolder();  ///< ends a look that is under way as soon as it can

 private:
  using Print = FilePrint;
  using Prints = std::map<std::string, Print>;  ///< by path below the folder, with slashes

  void run();
  void look();
  struct Files {
    Prints prints;
    SideFiles sides;
    std::vector<std::string> closed;  ///< folders below that cannot be read, each with a slash at its end
    std::set<std::string> packed;     ///< archives, which are not opened here
    std::string trouble;              ///< why not all are among them; what is not need not be gone
  };
  Files files() const;
  void remove_gone(const Files& now);
  void take(const std::string& path, const Print& print);
  /// Whether the service would take it now: files beside a raster are only packed then.
  std::optional<proto::Problem> refused(const Print& print, limits::Entry entry);
  std::optional<proto::Problem> begin(const std::string& path, const Print& print);
  std::optional<proto::Problem> change(const std::string& path, const Print& print, const Dataset& dataset);
  /// The raster; or, with what lies beside it, one file in the room. Problems: "storage-full", "service-stopping".
  proto::Result<std::filesystem::path> with_sides(const std::string& path, const Upload& room);
  std::string new_id(const std::string& path) const;
  bool stops();
  /// In the log, once until there is something else to say of this path.
  void warn(const std::string& path, const std::string& what);

  void write_notes();

  Service& service_;
  const std::filesystem::path folder_;
  LiveNotes notes_;
  std::map<std::string, LiveNote>& known_ = notes_.by_path;
  SideFiles sides_;                          ///< in this look
  Prints seen_;                              ///< in the last look: a file that is still being written is another one every time
  std::map<std::string, int> missed_;        ///< looks that did not find a known file
  std::map<std::string, std::string> told_;  ///< by path; the folder's own is empty
  std::mutex mutex_;
  std::condition_variable ending_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace cordillera::server
