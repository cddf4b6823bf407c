#include "server/memory/memory_limit.h"

#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <new>

#include "proto/cores.h"

namespace cordillera::server {
namespace {

constexpr std::uint32_t kDefault_mib = 4096;
/// Of a thread's stack. A limit counts stacks whole, and by default each has 8 MiB: ten would take most of the least memory.
constexpr std::size_t kStack_bytes = std::size_t{2} << 20;

/// Of threads that begin from now on.
void make_stacks_small() {
  pthread_attr_t attributes;
  if (pthread_getattr_default_np(&attributes) != 0) return;
  std::size_t usual = 0;
  if (pthread_attr_getstacksize(&attributes, &usual) == 0 && usual > kStack_bytes &&
      pthread_attr_setstacksize(&attributes, kStack_bytes) == 0)
    pthread_setattr_default_np(&attributes);
  pthread_attr_destroy(&attributes);
}

/// Private memory of this process so far, as RLIMIT_DATA counts it.
rlim_t data_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    rlim_t kib = 0;
    if (word == "VmData:" && status >> kib) return kib << 10;
  }
  return 0;
}

// What a handler without arguments has to know.
std::string g_words;
int g_descriptor = -1;
std::atomic_flag g_ending = ATOMIC_FLAG_INIT;

void end_for_want_of_memory() {
  while (g_ending.test_and_set()) pause();  // another thread is at it
  [[maybe_unused]] const ssize_t told = write(g_descriptor, g_words.data(), g_words.size());
  _exit(1);
}

bool can_have(std::size_t bytes) {
  void* const place = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (place == MAP_FAILED) return false;
  munmap(place, bytes);
  return true;
}

/// GDAL aborts where it gets no memory. Is there none? If there is, the abort has another reason and goes on.
void on_abort(int) {
  constexpr std::size_t kLittle = 1 << 20;
  if (!can_have(kLittle)) end_for_want_of_memory();
}

}  // namespace

bool may_use_cuda(const proto::BuildOptions& options) {
  std::error_code ignored;
  const auto exists = [&](const char* device) { return std::filesystem::exists(device, ignored); };
  return options.device() != "cpu" && (exists("/dev/nvidiactl") || exists("/dev/dxg"));
}

std::uint32_t default_memory_mib(const proto::BuildOptions& options) {
  return std::max(kDefault_mib, kMemoryPerThread_mib * proto::threads_for(options.threads()));
}

void limit_memory(proto::BuildOptions& options) {
  if (options.memory() == 0) return;
  options.set_threads(std::min(proto::threads_for(options.threads()), std::max(1u, options.memory() / kMemoryPerThread_mib)));
  if (may_use_cuda(options)) return;
  make_stacks_small();
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_max = std::min(limit.rlim_max, data_bytes() + (rlim_t{options.memory()} << 20));
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_DATA, &limit);
}

bool memory_is_short() {
  constexpr std::size_t kFew_bytes = std::size_t{8} << 20;
  return !can_have(kFew_bytes);
}

proto::Problem out_of_memory(const proto::BuildOptions& options, const std::string& raster) {
  const std::string most = options.memory() == 0 ? "there is" : "memory=" + std::to_string(options.memory()) + " MiB allows";
  return {"memory-limit", "building " + raster + " needs more memory than " + most,
          "more memory, fewer threads, a smaller bbox or a lower max_level", "memory"};
}

void on_out_of_memory(int descriptor, const std::string& words) {
  g_descriptor = descriptor;
  g_words = words;
  std::set_new_handler(end_for_want_of_memory);
  signal(SIGABRT, on_abort);
}

}  // namespace cordillera::server
