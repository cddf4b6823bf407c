#pragma once
// Whether the service takes on one more upload. What it takes it can finish: a place in the queue and a dataset are set
// aside while the body still comes.
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "proto/result.h"
#include "server/limits/space.h"
#include "server/options/options.h"

namespace cordillera::server {
class Registry;
}

namespace cordillera::server::limits {

/// Held while an upload is under way.
using Slot = std::shared_ptr<void>;

/// A request that is sent again has its dataset, and its place in the queue, already. A part of an upload needs neither yet. What
/// is fetched from an address needs both, and counts for itself from then on: its place is that of the client.
enum class Entry { fresh, again, part, address };

/// What is taken up now.
struct InUse {
  std::size_t datasets = 0;
  std::size_t queue = 0;
  std::size_t uploads = 0;
};

/// 507, with the sentence of Space.
proto::Problem storage_full(const std::string& why);

/// Thread-safe.
class Admission {
 public:
  Admission(const Limits& limits, const std::filesystem::path& data, const Registry& registry);

  /// Takes a place for a body of so many bytes (nothing: unknown) of this client, if there is room for it.
  proto::Result<Slot> enter(const std::string& client, std::optional<std::uint64_t> bytes, Entry entry = Entry::fresh);

  InUse in_use() const;
  /// The free space of the disk that holds the data. Every way in takes its bytes from it.
  Space& space() { return space_; }

 private:
  std::optional<proto::Problem> refused_fresh() const;
  std::optional<proto::Problem> refused(const std::string& client, std::uint64_t bytes, Entry entry) const;

  const Limits limits_;
  const Registry& registry_;
  Space space_;
  mutable std::mutex mutex_;
  std::map<std::string, std::uint32_t> of_client_;
  std::uint32_t uploads_ = 0;  ///< whole rasters under way
  std::uint32_t parts_ = 0;    ///< parts of uploads under way, and rasters that are fetched
};

}  // namespace cordillera::server::limits
