#include "server/limits/descriptors.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace cordillera::server::limits {
namespace {

constexpr std::size_t kOwn =
    28;  // 18 of logs, the registry, the lock and two clocks; the rest is what libraries open for a moment
constexpr std::size_t kOfALoop = 3;     // epoll, its timer and its event
constexpr std::size_t kForALoop = 32;   // with fewer a loop would take more than it serves
constexpr std::size_t kOfAJob = 4;      // both ends of its two pipes, while it starts
constexpr std::size_t kOfADataset = 5;  // four connections to its store, and a share of earlier versions

}  // namespace

std::size_t raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return SIZE_MAX;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

void hold_standard_descriptors() {
  // The lowest one that is free is taken.
  for (const int standard : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(standard, F_GETFD) == -1) open("/dev/null", standard == STDIN_FILENO ? O_WRONLY : O_RDONLY);
  }
}

std::string fit_to_descriptors(ServeSettings& settings, std::size_t descriptors) {
  Limits& limits = settings.limits;
  const auto lower = [](std::uint32_t& limit, std::size_t most) {
    limit = static_cast<std::uint32_t>(std::clamp<std::size_t>(most, 1, limit));
  };
  lower(limits.loops, descriptors / kForALoop);
  const std::size_t processes = std::size_t{2} * settings.jobs + 1;  // as many dry runs beside the builds, and a first look
  const std::size_t own = kOwn + kOfALoop * limits.loops + kOfAJob * processes;
  const auto for_datasets = [&] { return kOfADataset * limits.open_datasets + limits.open_archives; };
  const std::size_t most_sockets = limits.connections + refused_sockets(limits.connections);
  if (descriptors >= own + most_sockets + limits.uploads + for_datasets()) return "";
  const std::size_t rest = descriptors - std::min(descriptors, own);
  lower(limits.open_datasets, rest / 16);
  lower(limits.open_archives, rest / 16);
  lower(limits.uploads, rest / 8);
  const std::size_t sockets = rest - std::min(rest, limits.uploads + for_datasets());
  lower(limits.connections, sockets - std::min(sockets, refused_sockets(sockets)));
  // Nobody alone takes all.
  lower(limits.client_connections, limits.connections / 2);
  lower(limits.client_uploads, limits.uploads / 2);
  return "the system allows " + std::to_string(descriptors) + " descriptors, so there are at most " +
         std::to_string(limits.connections) + " connections, " + std::to_string(limits.client_connections) + " of one address, " +
         std::to_string(limits.uploads) + " uploads, " + std::to_string(limits.client_uploads) + " of one client, and " +
         std::to_string(limits.open_datasets) + " open datasets; ulimit -n, or LimitNOFILE= of a unit, allows more";
}

}  // namespace cordillera::server::limits
