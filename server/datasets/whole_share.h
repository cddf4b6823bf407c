#pragma once
// One share of a job over all its stages.
#include "cordillera.pb.h"

namespace cordillera::server {

/// 0 to 1: where the stage stands among all, and how much of it is done. A stage that is left out is passed over.
double whole_share(const proto::Progress& progress);

}  // namespace cordillera::server
