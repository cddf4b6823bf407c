#include "server/options/option_groups.h"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

namespace cordillera::server {
namespace {

using Names = std::vector<std::string_view>;

/// A list of forty options is read by nobody: what belongs together stands together.
const std::vector<std::pair<const char*, Names>>& groups() {
  static const std::vector<std::pair<const char*, Names>> kGroups = {
      {"Output", {"title", "attribution", "imagery", "dry-run"}},
      {"Raster", {"name", "band", "crs", "feather"}},
      {"Heights and voids", {"vertical-datum", "nodata", "voids", "fill-limit", "water", "water-mask", "z-scale", "z-offset"}},
      {"Levels and errors", {"error", "keep", "pixels", "bbox", "min-level", "max-level", "strategy", "quality"}},
      {"Machine", {"device", "threads", "memory"}},
      {"Posts", {"private", "provisional", "build"}},
      {"Who may write, and logs",
       {"tokens", "token-lines", "insecure-writes", "trusted-proxies", "source-allow", "live-open", "audit-log", "log-level",
        "log-format"}},
      {"Service", {"listen", "data", "web", "geoids", "jobs", "mount", "live", "live-fresh", "cache-size", "keep-versions"}}};
  return kGroups;
}

}  // namespace

std::string group_of(const OptionSpec& option) {
  const auto is_it = [&](const LimitOption& limit) { return limit.option.name == option.name; };
  if (std::any_of(limit_options().begin(), limit_options().end(), is_it)) return "Limits";
  for (const auto& [group, names] : groups()) {
    if (std::find(names.begin(), names.end(), option.name) != names.end()) return group;
  }
  return "Others";
}

}  // namespace cordillera::server
