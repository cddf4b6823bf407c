#pragma once
// What a query may say of a raster that is posted, changed or looked at by its address: tables for the one reader of options.
// Bodies of JSON and of forms say the same.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/datasets/registry.h"
#include "server/options/options.h"

namespace cordillera::server {

/// How a query names a raster that is not the body.
struct RasterWords {
  std::string upload;   ///< id of an upload that arrived in parts
  std::string address;  ///< that the service is to fetch it from
};

/// Of a POST.
struct PostWords {
  Settings settings;
  RasterWords raster;
  std::optional<bool> updates;
};
const std::vector<OptionOf<PostWords>>& post_words();
/// The first of options that came in a body and that a POST does not have. kind: what it is there, "member" of JSON, "field" of a
/// form.
std::optional<proto::Problem> unknown_in_body(const Given& options, const std::string& kind);

/// Of what adds or replaces one raster of several.
struct ChangeWords {
  Settings settings;
  RasterWords raster;
  std::optional<std::uint32_t> position;
};
const std::vector<OptionOf<ChangeWords>>& change_words();

/// Of /v1/live: url, and options of a POST but for those that say how the raster comes and when it is built.
struct LiveWords {
  Settings settings;
  std::string url;
};
const std::vector<OptionOf<LiveWords>>& live_words();

/// Of a PATCH: what of a dataset changes without a build.
const std::vector<OptionOf<Dataset>>& description_words();

}  // namespace cordillera::server
