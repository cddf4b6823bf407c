#pragma once
// cordillera simplify: a mesh file in, a smaller one out; no tiles, no raster.
#include <cstdint>
#include <optional>
#include <string>

#include "gpu/fit/simplify_height_mesh.h"
#include "proto/result.h"
#include "server/cli/commands.h"
#include "server/options/cleap_options.h"

namespace cordillera::server {

/// The command line as it was typed.
struct SimplifyLine {
  std::string input, output;
  Given given;  ///< options of simplify_options()
  Show show = Show::table;
};

/// What the options say, each for itself.
struct SimplifyWish {
  std::optional<double> keep, error_m;  ///< one of these two and the next
  std::optional<std::uint64_t> triangles, collapses;
  std::string quality = "default", strategy = "waves", device = "auto";
  std::uint32_t threads = 0;
  CleapRequest cleap;
};
const std::vector<OptionOf<SimplifyWish>>& simplify_options();

/// What they ask for together.
struct SimplifyRequest {
  std::string strategy = "waves";
  gpu::fit::MeshTarget target;
  gpu::fit::MeshOptions options;
  std::optional<CleapRequest> cleap;  ///< instead of both, if the strategy says so
  unsigned threads = 0;               ///< 0: one for each usable core
};

/// What is wrong with a line is the first thing that is.
proto::Result<SimplifyRequest> simplify_request(const SimplifyLine& line);

int simplify_command(const SimplifyLine& line);

}  // namespace cordillera::server
