#pragma once
// This machine, for names that several machines or processes must not share, and for what a process may have left behind.
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace cordillera::raster {

/// Whether a process of this machine is there.
inline bool is_alive(pid_t process) { return kill(process, 0) == 0 || errno == EPERM; }

inline std::string host_name() {
  char host[128] = "";
  gethostname(host, sizeof host - 1);
  return host;
}

}  // namespace cordillera::raster
