#include "server/api/estimate_json.h"

#include <initializer_list>

#include "pipeline/tileset/manifest_json.h"
#include "server/api/api.h"

namespace cordillera::server {
namespace {

Json only(const Json& from, std::initializer_list<const char*> names) {
  Json json;
  for (const char* name : names) {
    if (from.contains(name)) json[name] = from[name];
  }
  return json;
}

}  // namespace

Json estimate_json(const proto::Manifest& estimated, double seconds) {
  const bool shares = estimated.options().keep_size() > 0;  // the tolerances behind them are found when it is built
  Json manifest = Json::parse(pipeline::manifest_json(estimated));
  Json levels = Json::array();
  for (const Json& level : manifest["levels"]) {
    levels.push_back(only(level, {"level", "tiles", "triangles", "drc_bytes", "target"}));
    if (shares) levels.back().erase("target");
  }
  manifest["levels"] = levels;
  for (const char* name : {"bounds", "device"}) manifest.erase(name);
  const auto source = manifest.find("source");
  for (const char* name : {"nodata_share", "filled_share", "flat_water_share", "min_height", "max_height", "error_at_pixels"}) {
    if (source != manifest.end()) source->erase(name);
  }
  return {{"dry_run", true}, {"seconds", seconds}, {"manifest", manifest}};
}

Response dry_run(JobQueue& queue, const Request& request, const proto::Job& job, const std::filesystem::path& folder) {
  const auto estimate = queue.dry_run(folder, sender(request), job);
  return estimate ? json_response(200, estimate_json(estimate->manifest(), estimate->seconds()))
                  : problem_response(estimate.problem());
}

}  // namespace cordillera::server
