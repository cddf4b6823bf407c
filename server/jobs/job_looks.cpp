// The queue's part for tiles that people look at: which blocks are made next, and of a lazy dataset at all.
#include "pipeline/store/store.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {

bool is_lazy(const Dataset& dataset) { return dataset.options.build() == kLazy; }

/// A lazy build that has come as far as it does by itself: a look wakes it.
bool JobQueue::waits_for_looks(const Dataset& dataset) const {
  if (!is_lazy(dataset) || ledger_.pending(dataset.id) > 1) return false;  // another change needs all of its blocks
  const auto shown = pipeline::StoreReader::manifest_of(layout_.provisional(dataset.id).string());
  return shown.ok() && shown->has_done_blocks();
}

/// What was made of it was forgotten, and its raster with it: who reads it has it fetched again.
bool JobQueue::waits_for_readers(const Dataset& dataset) const {
  std::error_code error;
  return !dataset.address.empty() && !std::filesystem::exists(layout_.dataset(dataset.id) / dataset.raster, error);
}

void JobQueue::look(const Dataset& dataset, std::vector<proto::TileAddress> tiles, const proto::Manifest& shown, Who who) {
  const bool lazy = is_lazy(dataset);
  if (lazy) std::erase_if(tiles, [&](const proto::TileAddress& tile) { return !waits_for_block(shown, tile); });
  if (tiles.empty()) return;
  looked_at_.note(dataset.id, tiles, lazy || who == Who::waits ? LookedAt::Tell::now : LookedAt::Tell::now_and_then);
  if (lazy) wake(dataset);
}

/// A turn for a lazy dataset, unless it has one or is to have one.
void JobQueue::wake(const Dataset& dataset) {
  if (dataset.state == State::queued) return;  // its turn comes, or another attempt
  {
    const std::lock_guard lock(mutex_);
    const auto running = running_.find(dataset.id);
    if (running != running_.end()) running->second.looked_at = true;
    if (running != running_.end() && !running->second.pauses) return;
  }
  enqueue({dataset.id, owner_of(dataset), 0});
}

void JobQueue::look_again(const Dataset& dataset, std::vector<proto::TileAddress> tiles, const proto::Manifest& shown) {
  looked_at_.any_of(dataset.id, [&](const proto::TileAddress& known) { return std::erase(tiles, known), tiles.empty(); });
  look(dataset, std::move(tiles), shown, Who::waits);
}

void JobQueue::look_at_all(const Dataset& dataset) {
  looked_at_.note_all(dataset.id);
  wake(dataset);
}

/// A lazy build whose job has ended: at the end of the queue, if somebody looked at a block that it has not come to.
JobQueue::Next JobQueue::pause(const Dataset& dataset, Paused why) {
  forget_posted(dataset.id);
  bool looked_at = false;
  {
    const std::lock_guard lock(mutex_);
    const auto running = running_.find(dataset.id);
    if (running == running_.end()) return Next::done;
    running->second.pauses = true;  // from here on a look asks for a turn of its own
    looked_at = running->second.looked_at;
  }
  if (why == Paused::turn_is_over) return Next::again;
  const auto shown = pipeline::StoreReader::manifest_of(layout_.provisional(dataset.id).string());
  const bool more =
      looked_at_.all_wanted(dataset.id) || (shown.ok() && looked_at_.any_of(dataset.id, [&](const proto::TileAddress& tile) {
        return waits_for_block(*shown, tile);
      }));
  return more && looked_at ? Next::again : Next::done;
}

}  // namespace cordillera::server
