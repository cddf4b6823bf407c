#pragma once
// What cordillera simplify may be told of the strategies `cleap` and `sequential`, the published algorithm (gpu/cleap).
#include <map>
#include <string>
#include <vector>

#include "gpu/cleap/cleap.h"
#include "proto/result.h"
#include "server/options/option_values.h"

namespace cordillera::server {

struct CleapRequest {
  gpu::cleap::CollapseTarget target;
  double keep = 0;  ///< instead: a share of the input's triangles
  gpu::cleap::Options options;
  std::uint32_t smooth = 0;  ///< steps of Taubin's smoothing afterwards
};

struct CleapOption {
  std::string name;   ///< without --
  std::string value;  ///< what stands for the value in help
  std::string help, accepted;
  Complaint (*apply)(std::string_view text, CleapRequest& request);
};
const std::vector<CleapOption>& cleap_options();

/// given: by name, of the table.
proto::Result<CleapRequest> cleap_request(const std::string& strategy, const std::map<std::string, std::string>& given);

}  // namespace cordillera::server
