#pragma once
// Jobs on a disk that others write on too: a share of it stays free, whatever is unpacked and built.
#include <cstdint>
#include <string>

#include "server/jobs/child.h"

namespace cordillera::server {

/// As child_runner; the child leaves so much of its folder's disk free, and says "storage-full" where that is too little for it.
JobRunner child_runner(const std::string& program, std::uint32_t free_percent);
int job_main(const std::string& folder, int parent, std::uint32_t free_percent);

/// What a job has made that found no room goes, for others may need less. It is done again once there is more room than it had: with as much it would
/// only fill the disk again. Until then it is refused as it was.
JobRunner sparing(JobRunner runner, std::uint32_t free_percent);

}  // namespace cordillera::server
