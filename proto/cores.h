#pragma once
// How many threads are worth having.
#include <filesystem>

namespace cordillera::proto {

/// Cores that this thread may use, at least one: those that it may run on (taskset, a cpuset), and no more than the quota of time
/// of its control group, rounded up (a container's --cpus, systemd's CPUQuota=; version 2 of control groups), as the quota was at
/// the first call. std::thread::hardware_concurrency() counts all cores of the machine with some C libraries, Debian 12's among
/// them.
unsigned usable_cores();
/// As many threads as were asked for; 0: one for each usable core.
unsigned threads_for(unsigned asked);

/// The quota of a control group and of those above it, in cores rounded up; 0: there is none. groups: where the groups are
/// mounted (/sys/fs/cgroup); list: the file that says which one is meant (/proc/self/cgroup).
unsigned quota_cores(const std::filesystem::path& groups, const std::filesystem::path& list);

}  // namespace cordillera::proto
