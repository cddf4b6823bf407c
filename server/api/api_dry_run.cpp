// POST /v1/datasets?dry_run=1: what a build would make, without what only a build can know.
#include "server/api/api.h"
#include "server/api/estimate_json.h"

namespace cordillera::server {

Response dry_run(Service& service, const Request& request, const proto::Job& job, const std::filesystem::path& folder) {
  const auto estimate = service.queue().dry_run(folder, sender(request), job);
  return estimate ? json_response(200, estimate_json(estimate->manifest(), estimate->seconds()))
                  : problem_response(estimate.problem());
}

}  // namespace cordillera::server
