#include "raster/disk/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace cordillera::raster {
namespace {

/// The file is still the one of that name: who held it before removes it at its end.
bool is_named(int descriptor, const std::filesystem::path& path) {
  struct stat open {};
  struct stat named {};
  return fstat(descriptor, &open) == 0 && stat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

}  // namespace

Descriptor open_locked(const std::filesystem::path& path) {
  Descriptor file(::open(path.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0644));
  if (file.is_open() && flock(file.number(), LOCK_EX | LOCK_NB) != 0) return Descriptor();
  return file;
}

FileLock::FileLock(std::filesystem::path path) : path_(std::move(path)) {
  for (;;) {
    descriptor_ = open_locked(path_);
    others_ = !descriptor_.is_open() && errno == EWOULDBLOCK;
    if (!descriptor_.is_open() || is_named(descriptor_.number(), path_)) return;
  }
}

FileLock::~FileLock() {
  if (descriptor_.is_open()) ::unlink(path_.c_str());  // before it is free: the next one would lose its own
}

}  // namespace cordillera::raster
