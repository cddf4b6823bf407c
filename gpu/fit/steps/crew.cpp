#include "gpu/fit/steps/crew.h"

#include "proto/cores.h"

namespace cordillera::gpu::fit {
namespace {

/// Until it is another value; mostly that takes less than a thread needs to fall asleep and wake.
void wait_while(const std::atomic<unsigned>& value, unsigned old) {
  constexpr int kLooks = 4000;
  for (int k = 0; k < kLooks; ++k) {
    if (value.load(std::memory_order_acquire) != old) return;
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
  value.wait(old, std::memory_order_acquire);
}

}  // namespace

Crew::Crew(unsigned threads) {
  const unsigned wanted = proto::threads_for(threads);
  for (unsigned k = 1; k < wanted; ++k) others_.emplace_back([this] { serve(); });
}

Crew::~Crew() {
  over_ = true;
  turn_.fetch_add(1, std::memory_order_release);
  turn_.notify_all();
  for (std::thread& other : others_) other.join();
}

void Crew::run(std::size_t chunks, Call call, const void* work) {
  call_ = call;
  work_ = work;
  chunks_ = chunks;
  next_.store(0, std::memory_order_relaxed);
  busy_.store(static_cast<unsigned>(others_.size()), std::memory_order_relaxed);
  turn_.fetch_add(1, std::memory_order_release);
  turn_.notify_all();
  take();
  for (unsigned busy = busy_.load(std::memory_order_acquire); busy != 0; busy = busy_.load(std::memory_order_acquire)) {
    wait_while(busy_, busy);
  }
}

void Crew::take() {
  for (std::size_t chunk = next_++; chunk < chunks_; chunk = next_++) call_(work_, chunk);
}

void Crew::serve() {
  for (unsigned seen = 0;; ++seen) {
    wait_while(turn_, seen);
    if (over_) return;
    take();
    if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
  }
}

}  // namespace cordillera::gpu::fit
