#include "server/limits/admission.h"

#include "server/datasets/registry.h"
#include "server/limits/disk.h"

namespace cordillera::server::limits {
namespace {

using proto::Problem;

/// What has failed keeps nothing but its row, and the queue bounds those.
std::size_t kept_of(const StateCounts& counts) { return counts.queued + counts.running + counts.ready; }

std::string at_most(std::uint32_t count, const char* what) { return "at most " + std::to_string(count) + " " + what; }

}  // namespace

InUse Admission::in_use() const {
  const StateCounts counts = registry_.counts();
  InUse now;
  now.queue = counts.queued;
  now.datasets = kept_of(counts);
  const std::lock_guard lock(mutex_);
  now.uploads = uploads_ + parts_;
  return now;
}

Admission::Admission(const Limits& limits, const std::filesystem::path& data, const Registry& registry)
    : limits_(limits), registry_(registry), space_([data] { return disk_space(data); }, limits.free_percent) {}

proto::Problem storage_full(const std::string& why) {
  return {"storage-full", why, "a smaller raster, or posting when there is room again", ""};
}

std::optional<Problem> Admission::refused_fresh() const {
  const StateCounts counts = registry_.counts();
  if (kept_of(counts) + uploads_ >= limits_.datasets) {
    return Problem{"datasets-full", "this service holds as many datasets as it may",
                   at_most(limits_.datasets, "datasets; remove one by DELETE"), ""};
  }
  if (counts.queued + uploads_ >= limits_.queue) {
    return Problem{"queue-full", "as many builds as may wait are waiting", at_most(limits_.queue, "builds; post again later"),
                   ""};
  }
  return std::nullopt;
}

std::optional<Problem> Admission::refused(const std::string& client, std::uint64_t bytes, Entry entry) const {
  if (entry == Entry::fresh || entry == Entry::address) {
    if (auto full = refused_fresh()) return full;
  }
  if (uploads_ + parts_ >= limits_.uploads) {
    return Problem{"service-busy", "too many rasters are being sent at the moment",
                   at_most(limits_.uploads, "uploads; post again later"), ""};
  }
  const auto own = of_client_.find(client);
  if (own != of_client_.end() && own->second >= limits_.client_uploads) {
    return Problem{"too-many-uploads",
                   "you are sending " + std::to_string(own->second) + " rasters already, or have them fetched",
                   at_most(limits_.client_uploads, "uploads of one client at a time"), ""};
  }
  if (const std::string full = space_.full(bytes); !full.empty()) return storage_full(full);
  return std::nullopt;
}

proto::Result<Slot> Admission::enter(const std::string& client, std::optional<std::uint64_t> bytes, Entry entry) {
  const std::lock_guard lock(mutex_);
  if (auto why = refused(client, bytes.value_or(0), entry)) return *why;
  auto counter = entry == Entry::part || entry == Entry::address ? &Admission::parts_ : &Admission::uploads_;
  ++(this->*counter);
  ++of_client_[client];
  return Slot(this, [client, counter](void* admission) {
    auto* self = static_cast<Admission*>(admission);
    const std::lock_guard inner(self->mutex_);
    --(self->*counter);
    if (--self->of_client_[client] == 0) self->of_client_.erase(client);
  });
}

}  // namespace cordillera::server::limits
