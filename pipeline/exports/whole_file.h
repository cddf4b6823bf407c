#pragma once
// One-file exports appear whole, by a rename, or not at all.
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "pipeline/faces/face.h"
#include "pipeline/store/store.h"
#include "proto/result.h"

namespace cordillera::pipeline::exports {

/// Ends an export with what its user is to read.
struct Refused {
  proto::Problem problem;
};

/// Of a terrain that is stopped.
inline const proto::Problem kStopped{"cancelled", "the export was stopped, and nothing of it is kept", "", ""};

/// What stands at a place that a face itself has named. Throws Refused where the face cannot make it, and once the terrain is
/// stopped; StoreError where nothing is there.
faces::Document made(const faces::Terrain& terrain, const faces::Resource& resource, const faces::Place& place);

/// "store-damaged". what: is read.
proto::Problem damaged(const std::string& what, const std::exception& damage);
/// "output-failed".
proto::Problem unwritable(const std::string& path, const std::string& why);

/// Whether write_export would take the path: to be asked before hours of work.
proto::Result<void> check_output_file(const std::string& path, Existing other);

/// Between the name of what a process writes and the process's number, of a folder that is given its name when it is whole.
inline constexpr const char* kPartial = ".partial-";

/// Removes what killed processes have left in a folder: files and folders called `before`, the number of the process, and one of
/// `ends`. What cannot be removed does no harm. A number says nothing of processes of other machines and containers: a place is
/// for one export at a time.
void remove_left_behind(const std::filesystem::path& folder, const std::string& before, std::initializer_list<const char*> ends);

/// Calls write with a sibling of path that does not exist yet, and moves it into place. What write throws (Refused, StoreError,
/// the standard streams' and file system's failures) is a problem ("service-busy" for want of descriptors), and its file is gone,
/// as are those of killed processes. It does not wait for the disk, as raster::write_whole does: an export is made again from its
/// store.
proto::Result<void> write_export(const std::string& path, Existing other,
                                 const std::function<void(const std::filesystem::path& sibling)>& write);

/// A file that goes with the scope, unless it was moved away.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path path) : path_(std::move(path)) {}
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// An empty binary file that throws std::ios_base::failure when it cannot be written; NoDescriptor where none is left.
std::ofstream opened(const std::filesystem::path& path);
/// The same of a file that is there, to be read.
std::ifstream opened_to_read(const std::filesystem::path& path);
void append(std::ostream& out, std::string_view bytes);

}  // namespace cordillera::pipeline::exports
