#pragma once
// What a scheduler is to set aside for a task.
#include <cstddef>
#include <cstdint>

#include "work.pb.h"

namespace cordillera::pipeline::work {

/// MiB that a task of the stage takes on one thread, the program included.
std::uint32_t memory_mib_of(const proto::WorkPlan& plan, std::size_t stage);

}  // namespace cordillera::pipeline::work
