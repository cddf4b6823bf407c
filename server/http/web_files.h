#pragma once
// The viewer's files, each once in memory however many clients read it.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "proto/lru.h"

namespace cordillera::server {

/// A file as it was read.
struct WebFile {
  std::string bytes;
  std::string etag;  ///< hex, without quotes
};

/// Thread-safe.
class WebFiles {
 public:
  /// The file as it is now: read once, and again when it has changed. Null: it cannot be read.
  std::shared_ptr<const WebFile> find(const std::filesystem::path& file);

 private:
  std::mutex mutex_;
  proto::Lru<std::string, std::shared_ptr<const WebFile>> kept_{std::size_t{32} << 20};
  std::unordered_map<std::string, std::weak_ptr<const WebFile>> read_;  ///< by somebody still, though it may not be kept
};

}  // namespace cordillera::server
