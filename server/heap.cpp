#include "server/heap.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <thread>

namespace cordillera::server {
namespace {

// Fixed: left alone, the C library raises it to the largest block that was ever freed, up to 32 MiB, and keeps such blocks.
constexpr int kMapFrom_bytes = 1 << 20;
constexpr int kTrimFrom_bytes = 4 << 20;
constexpr std::size_t kMuch_bytes = std::size_t{16} << 20;

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
}

void trim_heap() {
  const struct mallinfo2 heap = mallinfo2();
  if (resident_bytes() > heap.uordblks + heap.hblkhd + kMuch_bytes) malloc_trim(0);
}

}  // namespace cordillera::server
