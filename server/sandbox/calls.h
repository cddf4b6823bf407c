#pragma once
// System calls, by seccomp: an allow-list. The only place that knows libseccomp.
#include "server/sandbox/sandbox.h"

namespace cordillera::server::sandbox {

bool knows_seccomp();

/// From here on, for all threads. What is not on the list fails: ENOSYS where libraries then do without (calls that are newer
/// than Linux 5.0), EPERM elsewhere. tests/server/sandbox/job_calls.tsv names every call with its answer and the reason. False:
/// the kernel has no seccomp for us.
bool confine_calls(Gpu gpu);

}  // namespace cordillera::server::sandbox
