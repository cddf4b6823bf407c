#include "server/memory/heap.h"
#include "proto/cores.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <new>

namespace cordillera::server {
namespace {

// Fixed: left alone, the C library raises it to the largest block that was ever freed, up to 32 MiB, and keeps such blocks.
constexpr int kMapFrom_bytes = 1 << 20;
constexpr int kTrimFrom_bytes = 4 << 20;
constexpr std::size_t kMuch_bytes = std::size_t{16} << 20;
constexpr std::size_t kReserve_bytes = std::size_t{512} << 10;  // below kMapFrom_bytes: what is freed is the heap's own at once

std::atomic<void*> reserve{nullptr};
bool bounded = true;

/// Whether the system ever refuses memory: for a limit of addresses, or since it gives no more than there is.
bool refuses_memory() {
  rlimit addresses{};
  if (getrlimit(RLIMIT_AS, &addresses) != 0 || addresses.rlim_cur != RLIM_INFINITY) return true;
  int overcommit = 2;
  std::ifstream("/proc/sys/vm/overcommit_memory") >> overcommit;
  return overcommit == 2;
}

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
  mallopt(M_ARENA_MAX, std::clamp(static_cast<int>(proto::usable_cores()), 2, 8));
  std::set_new_handler(no_memory);
  bounded = refuses_memory();
  keep_reserve();
}

void keep_reserve() {
  if (reserve.load() != nullptr) return;
  void* none = nullptr;
  void* const fresh = std::malloc(kReserve_bytes);
  if (!reserve.compare_exchange_strong(none, fresh)) std::free(fresh);
}

bool has_memory(std::size_t bytes) {
  if (!bounded) return true;
  void* volatile probe = std::malloc(bytes);  // volatile: a compiler may leave out a block that nobody uses
  std::free(probe);
  return probe != nullptr;
}

void trim_heap() {
  const struct mallinfo2 heap = mallinfo2();
  if (resident_bytes() > heap.uordblks + heap.hblkhd + kMuch_bytes) malloc_trim(0);
}

}  // namespace cordillera::server
