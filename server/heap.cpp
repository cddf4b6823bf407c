#include "server/heap.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <new>
#include <thread>

namespace cordillera::server {
namespace {

// Fixed: left alone, the C library raises it to the largest block that was ever freed, up to 32 MiB, and keeps such blocks.
constexpr int kMapFrom_bytes = 1 << 20;
constexpr int kTrimFrom_bytes = 4 << 20;
constexpr std::size_t kMuch_bytes = std::size_t{16} << 20;
constexpr std::size_t kReserve_bytes = std::size_t{512} << 10;  // below kMapFrom_bytes: what is freed is the heap's own at once
constexpr std::size_t kLeft = 2;                                // so many of it beside the reserve, for work

std::atomic<void*> reserve{nullptr};

void no_memory() {
  std::free(reserve.exchange(nullptr));
  throw std::bad_alloc();  // not another try: it would eat up what the way out needs
}

/// Pages of this process that hold no file.
std::size_t resident_bytes() {
  std::size_t all = 0, resident = 0, files = 0;
  std::ifstream("/proc/self/statm") >> all >> resident >> files;
  return (resident - std::min(files, resident)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

void set_up_heap() {
  mallopt(M_MMAP_THRESHOLD, kMapFrom_bytes);
  mallopt(M_TRIM_THRESHOLD, kTrimFrom_bytes);
  // By default eight a core, each of which keeps what its threads freed.
  mallopt(M_ARENA_MAX, std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 2, 8));
  std::set_new_handler(no_memory);
  keep_reserve();
}

void keep_reserve() {
  if (reserve.load() != nullptr) return;
  // Not of the last that there is: whatever needs more than is left then fails, frees the reserve, and so does the next.
  std::array<void*, kLeft> left{};
  for (void*& block : left) block = std::malloc(kReserve_bytes);
  void* const fresh = left.back() != nullptr ? std::malloc(kReserve_bytes) : nullptr;
  for (void* const block : left) std::free(block);
  void* none = nullptr;
  if (!reserve.compare_exchange_strong(none, fresh)) std::free(fresh);
}

void trim_heap() {
  const struct mallinfo2 heap = mallinfo2();
  if (resident_bytes() > heap.uordblks + heap.hblkhd + kMuch_bytes) malloc_trim(0);
}

}  // namespace cordillera::server
