#pragma once
// Files, by Landlock: what is not named is refused. Where the kernel knows them, TCP, devices' own commands, signals and abstract
// sockets too.
#include "server/sandbox/sandbox.h"

namespace cordillera::server::sandbox {

/// Landlock's ABI here: 1 in Linux 5.13, 2 in Debian 12's own 6.1. 0: it has none, or it is switched off.
int landlock_abi();

/// False: this kernel has no Landlock for us, and nothing was done.
bool confine_files(const Needs& needs);

}  // namespace cordillera::server::sandbox
