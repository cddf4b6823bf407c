#pragma once
// What cordillera simplify may be told of the strategies `cleap` and `sequential`, the published algorithm (gpu/cleap).
#include <map>
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

/// given: by name, of the table.
proto::Result<CleapRequest> cleap_request(const std::string& strategy, const std::map<std::string, std::string>& given);

}  // namespace cordillera::server
