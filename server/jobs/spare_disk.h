#pragma once
// Jobs on a disk that others write on too: one that found no room is not begun again before there is more.
#include <cstdint>

#include "server/jobs/child.h"

namespace cordillera::server {

/// What a job has made that found no room goes, for others may need less. It is done again once there is more room than it had:
/// with as much it would only fill the disk again. Until then it is refused as it was.
JobRunner sparing(JobRunner runner, std::uint32_t free_percent);

}  // namespace cordillera::server
