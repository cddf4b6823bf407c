#pragma once
// Who works at a place of this machine: one process at a time.
#include <filesystem>

#include "raster/disk/descriptor.h"

namespace cordillera::raster {

/// Opens the lock file, which it makes, and locks it for as long as the descriptor is open. None: why not is in errno;
/// EWOULDBLOCK: another has it.
Descriptor open_locked(const std::filesystem::path& path);

/// Holds a lock file for as long as it lives, and removes it then. The lock ends with its process, also with one that is killed;
/// the file that it leaves is nobody's lock.
class FileLock {
 public:
  explicit FileLock(std::filesystem::path path);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  /// Another process has it. Where locks are not to be had, such as on some network file systems, nobody is told of.
  bool others() const { return others_; }

 private:
  std::filesystem::path path_;
  Descriptor descriptor_;
  bool others_ = false;
};

}  // namespace cordillera::raster
