#include "server/data/folder_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "proto/paths.h"
#include "raster/disk/file_lock.h"

namespace cordillera::server {

namespace fs = std::filesystem;
using proto::Problem;

std::optional<std::string> others_file(const Layout& layout) {
  std::error_code error;
  if (fs::exists(layout.registry(), error)) return std::nullopt;
  for (const auto& entry : fs::directory_iterator(layout.root, error)) {
    if (entry.path().filename() == kLostAndFound) continue;
    const bool started = entry.path() == layout.lock() || entry.path() == layout.incoming() || entry.path() == layout.datasets();
    if (!started || (entry.is_directory(error) && !fs::is_empty(entry.path(), error))) return entry.path().filename().string();
  }
  return std::nullopt;
}

FolderLock::FolderLock(const Layout& layout) : file_(raster::open_locked(layout.lock())), error_(errno) {}

std::string FolderLock::why_not(const std::string& holder) const {
  return error_ == EWOULDBLOCK ? holder + " uses it" : "it cannot be written: " + std::generic_category().message(error_);
}

bool is_locked(const Layout& layout) {
  const raster::Descriptor file(::open(layout.lock().c_str(), O_RDWR | O_CLOEXEC));
  return file.is_open() && flock(file.number(), LOCK_EX | LOCK_NB) != 0;
}

std::optional<Problem> refuse_live_folder(const fs::path& folder, const fs::path& data) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return Problem{"option-invalid", folder.string() + " is no folder", "a folder that rasters are put into", "--live"};
  const fs::path live = fs::weakly_canonical(folder, error), own = fs::weakly_canonical(data, error);
  if (!proto::lies_in(live, own) && !proto::lies_in(own, live)) return std::nullopt;
  return Problem{"options-conflict", "the data folder " + own.string() + " and " + live.string() + " lie in each other",
                 "folders of their own", "--live"};
}

}  // namespace cordillera::server
