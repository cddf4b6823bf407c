#include "proto/cores.h"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

namespace cordillera::proto {
namespace {

constexpr int kMostCores = 8192;

unsigned cores_to_run_on() {
  const std::unique_ptr<cpu_set_t, void (*)(cpu_set_t*)> set(CPU_ALLOC(kMostCores), [](cpu_set_t* one) { CPU_FREE(one); });
  const std::size_t size = CPU_ALLOC_SIZE(kMostCores);
  if (set && sched_getaffinity(0, size, set.get()) == 0) return static_cast<unsigned>(CPU_COUNT_S(size, set.get()));
  return std::thread::hardware_concurrency();
}

/// "200000 100000" are two cores; "max 100000" is no quota.
unsigned quota_of(const std::filesystem::path& group) {
  double quota = 0, period = 0;
  if (!(std::ifstream(group / "cpu.max") >> quota >> period) || !(quota > 0) || !(period > 0)) return 0;
  return static_cast<unsigned>(std::clamp(std::ceil(quota / period), 1.0, double{kMostCores}));
}

}  // namespace

unsigned quota_cores(const std::filesystem::path& groups, const std::filesystem::path& list) {
  std::ifstream lines(list);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("0::/")) continue;  // version 1 has a number and its controllers in front
    unsigned least = 0;
    auto own = std::filesystem::path(line.substr(4));
    while (true) {
      if (const unsigned here = quota_of(groups / own)) least = least ? std::min(least, here) : here;
      if (own.empty()) return least;
      own = own.parent_path();
    }
  }
  return 0;
}

unsigned usable_cores() {
  // Read once: options ask for every request, and a job that is confined later could not read it any more.
  static const unsigned quota = quota_cores("/sys/fs/cgroup", "/proc/self/cgroup");
  const unsigned cores = std::max(1u, cores_to_run_on());
  return quota ? std::min(cores, quota) : cores;
}

unsigned threads_for(unsigned asked) { return asked > 0 ? asked : usable_cores(); }

}  // namespace cordillera::proto
