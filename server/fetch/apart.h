#pragma once
// Work that nothing can interrupt, such as looking up a name: in a thread of its own, which is left behind when nobody wants its
// result any more.
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace cordillera::server::updates {

/// What the work gives, or throws. nullopt: given_up, which is asked a few times a second, was true before. work: outlives what
/// it is called by, so it holds what it needs. Throws std::system_error if there is no thread.
template <typename Result>
std::optional<Result> apart(std::function<Result()> work, const std::function<bool()>& given_up) {
  struct Shared {
    std::mutex mutex;
    std::condition_variable ended;
    std::optional<Result> result;
    std::exception_ptr thrown;
  };
  const auto shared = std::make_shared<Shared>();
  std::thread([shared, work = std::move(work)] {
    std::optional<Result> result;
    std::exception_ptr thrown;
    try {
      result = work();
    } catch (...) { thrown = std::current_exception(); }
    const std::lock_guard lock(shared->mutex);
    shared->result = std::move(result);
    shared->thrown = thrown;
    shared->ended.notify_all();
  }).detach();
  constexpr auto kBetweenLooks = std::chrono::milliseconds(50);
  std::unique_lock lock(shared->mutex);
  while (!shared->result && !shared->thrown) {
    if (given_up()) return std::nullopt;
    shared->ended.wait_for(lock, kBetweenLooks);
  }
  if (shared->thrown) std::rethrow_exception(shared->thrown);
  return std::move(shared->result);
}

}  // namespace cordillera::server::updates
