#pragma once
// The tokens in effect: those of a file, looked at again when it has changed, and those of an option or the environment.
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "server/access/tokens.h"

namespace cordillera::server::access {

/// Thread-safe.
class TokenFile {
 public:
  /// Both may be empty: then there are no tokens, and configured() is false. A file without a line is a file nonetheless.
  static proto::Result<std::unique_ptr<TokenFile>> open(const std::string& path, const std::string& lines);

  bool configured() const { return configured_; }
  Identity find(std::string_view token);

 private:
  struct Stamp {
    std::filesystem::file_time_type changed;
    std::uintmax_t bytes = 0;
    bool operator==(const Stamp&) const = default;
  };
  TokenFile() = default;
  proto::Result<void> read(const Stamp& stamp);
  Stamp stamp() const;
  void refresh();

  std::filesystem::path path_;
  bool configured_ = false;
  std::vector<TokenLine> fixed_;
  std::mutex mutex_;
  Stamp seen_;
  std::shared_ptr<const std::vector<TokenLine>> lines_;
};

}  // namespace cordillera::server::access
