// POST /v1/datasets?dry_run=1: what a build would make, without what only a build can know.
#include <initializer_list>

#include "server/api.h"
#include "server/json.h"

namespace cordillera::server {
namespace {

Json only(const Json& from, std::initializer_list<const char*> names) {
  Json json;
  for (const char* name : names) {
    if (from.contains(name)) json[name] = from[name];
  }
  return json;
}

Json estimate_json(const proto::Estimate& estimate) {
  const bool shares = estimate.manifest().options().keep_size() > 0;  // the tolerances behind them are found when it is built
  Json manifest = to_json(estimate.manifest());
  Json levels = Json::array();
  for (const Json& level : manifest["levels"]) {
    levels.push_back(only(level, {"level", "tiles", "triangles", "drc_bytes", "glb_bytes", "target"}));
    if (shares) levels.back().erase("target");
  }
  manifest["levels"] = levels;
  for (const char* name : {"bounds", "device"}) manifest.erase(name);
  const auto source = manifest.find("source");
  for (const char* name : {"nodata_share", "flat_water_share", "min_height", "max_height", "resampling_error"}) {
    if (source != manifest.end()) source->erase(name);
  }
  return {{"dry_run", true}, {"seconds", estimate.seconds()}, {"manifest", manifest}};
}

}  // namespace

Response dry_run(Service& service, const proto::Job& job, const std::filesystem::path& folder) {
  const auto estimate = service.queue().dry_run(folder, job);
  return estimate ? json_response(200, estimate_json(*estimate)) : problem_response(estimate.problem());
}

}  // namespace cordillera::server
