#include "server/sandbox/sandbox.h"

#include <sys/prctl.h>

#include "server/sandbox/calls.h"
#include "server/sandbox/files.h"

#ifdef __SANITIZE_ADDRESS__  // g++
#define CORDILLERA_LEAKS_ARE_LOOKED_FOR
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)  // clang
#define CORDILLERA_LEAKS_ARE_LOOKED_FOR
#endif
#endif

#ifdef CORDILLERA_LEAKS_ARE_LOOKED_FOR
// LeakSanitizer looks at its own process as a debugger does, which a confined one may not. It asks when the process ends.
static bool g_confined = false;
extern "C" int __lsan_is_turned_off() { return g_confined ? 1 : 0; }
#endif

namespace cordillera::server::sandbox {

Confined confine(const Needs& needs) {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {};
  Confined confined;
  confined.files = confine_files(needs);
  confined.syscalls = confine_calls(needs.gpu);
#ifdef CORDILLERA_LEAKS_ARE_LOOKED_FOR
  g_confined = confined.syscalls;
#endif
  return confined;
}

Confined offered() { return {landlock_abi() > 0, knows_seccomp()}; }

std::string offered_words() {
  const int abi = landlock_abi();
  const std::string files = abi > 0 ? "Landlock ABI " + std::to_string(abi) : "no Landlock";
  return (knows_seccomp() ? "seccomp, " : "no seccomp, ") + files;
}

}  // namespace cordillera::server::sandbox
