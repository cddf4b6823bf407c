#include "raster/disk/work_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace cordillera::raster {

namespace fs = std::filesystem;

WorkFolder::WorkFolder(const fs::path& place) : path_(place.string() + ".partial") {
  // Another process may move its own into place between our opening it and our lock.
  do {
    close();
    open();
  } while (held_ && !is_at_path());
  if (!held_) return;
  for (const fs::directory_entry& left : fs::directory_iterator(path_)) fs::remove_all(left.path());
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  if (held_ && is_at_path()) fs::remove_all(path_, ignored);
  close();
}

void WorkFolder::open() {
  fs::create_directories(path_);
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) throw fs::filesystem_error("cannot be opened", path_, std::error_code(errno, std::generic_category()));
  // A file system without such locks has one process at a time, or two that disturb each other.
  held_ = flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void WorkFolder::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

bool WorkFolder::is_at_path() const {
  struct stat ours {
  }, there{};
  return fstat(descriptor_, &ours) == 0 && stat(path_.c_str(), &there) == 0 && ours.st_ino == there.st_ino &&
         ours.st_dev == there.st_dev;
}

}  // namespace cordillera::raster
