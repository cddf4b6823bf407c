#pragma once
// A raster that is sent: it must stay what it was until its last byte is read.
#include <sys/stat.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"
#include "raster/disk/descriptor.h"

namespace cordillera::server::client {

class LocalFile {
 public:
  static proto::Result<std::unique_ptr<LocalFile>> open(const std::string& path);

  std::uint64_t size() const { return static_cast<std::uint64_t>(state_.st_size); }
  /// Bytes from an offset on, valid until the next call; none: they cannot be read, or the file has changed.
  std::optional<std::string_view> read(std::uint64_t from, std::size_t most);
  /// Whether a read was refused, for one of the two reasons.
  const std::optional<proto::Problem>& problem() const { return problem_; }
  /// The same text: the same bytes. A change that keeps size and time of writing still changes the time of the inode.
  std::string identity() const;
  const std::string& path() const { return path_; }  ///< absolute, without links

 private:
  LocalFile(std::string path, raster::Descriptor file) : path_(std::move(path)), file_(std::move(file)) {}
  bool changed() const;

  std::string path_;
  raster::Descriptor file_;
  struct stat state_ = {};
  std::vector<char> bytes_;
  std::optional<proto::Problem> problem_;
};

}  // namespace cordillera::server::client
