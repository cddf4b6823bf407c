#pragma once
// What cordillera simplify may be told of the strategies `cleap` and `sequential`, the published algorithm (gpu/cleap).
#include <string>
#include <vector>

#include "gpu/cleap/cleap.h"
#include "proto/result.h"
#include "server/options/table_reader.h"

namespace cordillera::server {

struct CleapRequest {
  gpu::cleap::CollapseTarget target;
  double keep = 0;  ///< instead: a share of the input's triangles
  gpu::cleap::Options options;
  std::uint32_t smooth = 0;  ///< steps of Taubin's smoothing afterwards
};

using CleapOption = OptionOf<CleapRequest>;
const std::vector<CleapOption>& cleap_options();

/// The same for a strategy, with what `sequential` has of its own. given: as on the command line.
proto::Result<CleapRequest> checked_cleap(CleapRequest request, const std::string& strategy, const Given& given);

}  // namespace cordillera::server
