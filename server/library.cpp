#include "server/library.h"

#include <algorithm>

#include "server/log.h"

namespace cordillera::server {

namespace {
constexpr std::size_t kMostOpen = 64;  // a few descriptors each
}

proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> Library::open(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(open_.begin(), open_.end(), [&](const auto& entry) { return entry.first == id; });
  metrics_.store_opens.add(1, {found != open_.end() ? "hit" : "miss"});
  if (found != open_.end()) {
    open_.splice(open_.begin(), open_, found);
    return open_.front().second;
  }
  auto reader = pipeline::StoreReader::open(layout_.store(id).string());
  if (!reader) {
    log_warning("dataset " + id + ": " + reader.problem().detail);  // with its place on this machine, which is nobody else's business
    return proto::Problem{"internal", "what was built of dataset " + id + " can no longer be read", "posting the raster again", ""};
  }
  open_.emplace_front(id, std::make_shared<const pipeline::faces::Terrain>(std::move(reader).value()));
  if (open_.size() > kMostOpen) open_.pop_back();
  return open_.front().second;
}

void Library::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  open_.remove_if([&](const auto& entry) { return entry.first == id; });
}

}  // namespace cordillera::server
