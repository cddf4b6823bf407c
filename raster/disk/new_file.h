#pragma once
// A file that is written once, from its beginning to its end.
#include <fcntl.h>
#include <unistd.h>

#include <filesystem>
#include <string_view>

#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"

namespace cordillera::raster {

class NewFile {
 public:
  /// Of a name that is not there yet. mode: who may read it, less what the process's umask takes away.
  explicit NewFile(const std::filesystem::path& path, mode_t mode = 0640)
      : file_(::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, mode)) {}
  ~NewFile() { close(); }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  bool is_open() const { return file_.is_open(); }
  bool write(std::string_view bytes) { return write_all(file_.number(), bytes); }
  /// False if not everything is on disk.
  bool close() {
    const bool synced = file_.is_open() && fsync(file_.number()) == 0;
    return file_.close() && synced;
  }

 private:
  Descriptor file_;
};

}  // namespace cordillera::raster
