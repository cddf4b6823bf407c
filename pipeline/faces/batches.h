#pragma once
// Tiles are made independently of each other, and listed and written in an order.
#include <functional>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "pipeline/threads/workers.h"

namespace cordillera::pipeline::faces {

/// Items that threads work on, up to four a thread at a time, and that are then taken one after the other, in the order in which
/// they were added. What work or take throws, add and finish throw.
template <class Item>
class Batches {
 public:
  using Step = std::function<void(Item& item)>;
  /// threads: 0: one for each usable core; 1: the caller's alone. work is called by any of them, take by the caller's; it may be
  /// empty.
  Batches(unsigned threads, Step work, Step take) : work_(std::move(work)), take_(std::move(take)) {
    if (threads == 1) return;
    try {
      workers_ = std::make_unique<Workers>(threads);
    } catch (const std::system_error&) {}  // no threads are to be had: the caller's does it
  }

  void add(Item item) {
    waiting_.push_back(std::move(item));
    if (waiting_.size() >= (workers_ ? kItemsOfThread * workers_->threads() : 1)) finish();
  }
  /// All that were added are done.
  void finish() {
    if (workers_)
      workers_->each(waiting_.size(), [this](std::size_t k, unsigned) { work_(waiting_[k]); });
    else
      for (Item& item : waiting_) work_(item);
    if (take_) {
      for (Item& item : waiting_) take_(item);
    }
    waiting_.clear();
  }

 private:
  static constexpr std::size_t kItemsOfThread =
      4;  ///< in memory at a time; with fewer, threads would be idle at each batch's end

  std::unique_ptr<Workers> workers_;
  Step work_, take_;
  std::vector<Item> waiting_;
};

}  // namespace cordillera::pipeline::faces
