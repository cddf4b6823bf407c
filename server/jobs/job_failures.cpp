// The queue's part for datasets that have failed: they are kept to be asked about, and of too many the oldest go.
#include <algorithm>
#include <functional>

#include "server/jobs/job_queue.h"
#include "server/log/log.h"

namespace cordillera::server {

/// Who waits for one that has just failed is still to be told, whenever it was posted.
void JobQueue::note_failed(const std::string& id) {
  const std::lock_guard lock(mutex_);
  std::erase(failed_lately_, id);
  failed_lately_.push_back(id);
  if (failed_lately_.size() > kMostFailed) failed_lately_.pop_front();
}

/// The one that failed last first. Of those that a former process saw fail it is known when they were posted.
std::vector<Row> JobQueue::all_failed() {
  std::vector<Row> failed = registry_.list();
  std::erase_if(failed, [](const Row& row) { return row->state != State::failed; });
  std::map<std::string, std::size_t> order;
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& id : failed_lately_) order[id] = order.size() + 1;
  }
  const auto place = [&](const Row& row) {
    const auto known = order.find(row->id);
    return known == order.end() ? 0 : known->second;
  };
  std::ranges::stable_sort(failed, std::greater<>(), place);
  return failed;
}

/// Their folders have gone already.
void JobQueue::forget_oldest_failed() {
  if (registry_.counts().failed <= kMostFailed) return;
  const std::vector<Row> failed = all_failed();
  for (std::size_t k = kMostFailed; k < failed.size(); ++k) {
    const std::string& id = failed[k]->id;
    bool removed = false;
    ledger_.apart([&] { removed = registry_.remove_failed(id); });
    if (!removed) continue;  // read again meanwhile, or deleted
    published_(id);
    hub_.forget(id);
    log_info("dataset " + id + ": removed, for more than " + std::to_string(kMostFailed) + " have failed since");
  }
}

}  // namespace cordillera::server
