#pragma once
// Uploads that arrive in parts, over any number of connections and restarts: a folder each in data/uploads.
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "proto/result.h"
#include "server/http/message.h"

namespace cordillera::server::uploads {

struct PartFile {
  std::string id;
  std::string name;          ///< of the raster, if the client told it
  std::string owner;         ///< name of the token that began it; empty: none was shown
  std::string sender;        ///< whose number of unfinished uploads it counts in
  std::uint64_t length = 0;  ///< bytes that are to come in all
  std::uint64_t offset = 0;  ///< bytes that are on disk for good
};

inline constexpr std::size_t kMostUnfinished = 1000, kMostOfOneSender = 100;
inline constexpr int kKeptDays = 7;  ///< without a new byte

/// Thread-safe.
class PartFiles {
 public:
  explicit PartFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// length, name, owner and sender are taken; the rest is filled in.
  proto::Result<PartFile> create(PartFile wanted);
  std::optional<PartFile> find(const std::string& id) const;
  /// Writes what comes behind what is there, and says how much is on disk for good then. If the body broke off, what came is kept
  /// too; problem: "body-incomplete".
  proto::Result<PartFile> append(const std::string& id, std::uint64_t offset, const Request& request);
  void remove(const std::string& id);
  /// Where the bytes of a finished upload are.
  std::filesystem::path bytes_of(const std::string& id) const { return folder_ / id / "part"; }
  /// Removes what nobody has gone on with for kKeptDays, and what a killed process left without a description.
  void remove_old();

 private:
  std::optional<proto::Problem> too_many(const std::string& sender) const;
  bool write_down(const PartFile& file) const;

  std::filesystem::path folder_;
  std::mutex mutex_;
  std::set<std::string> in_use_;
};

}  // namespace cordillera::server::uploads
