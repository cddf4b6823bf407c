#pragma once
// Whether a process of this machine is there: of what one may have left behind.
#include <signal.h>

#include <cerrno>

namespace cordillera::raster {

inline bool is_alive(pid_t process) { return kill(process, 0) == 0 || errno == EPERM; }

}  // namespace cordillera::raster
