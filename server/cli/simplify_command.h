#pragma once
// cordillera simplify: a mesh file in, a smaller one out; no tiles, no raster.
#include <map>
#include <optional>
#include <string>

#include "gpu/fit/simplify_height_mesh.h"
#include "proto/result.h"
#include "server/cli/commands.h"
#include "server/options/cleap_options.h"

namespace cordillera::server {

/// The command line as it was typed; empty: not given.
struct SimplifyLine {
  std::string input, output;
  std::string keep, triangles, error, collapses;  ///< one of the four; the last for cleap and sequential only
  std::string quality = "default";
  std::string strategy = "waves";
  std::map<std::string, std::string> cleap;  ///< options of that table, as given
  std::string device = "auto";
  std::string threads = "0";
  Show show = Show::table;
};

/// The same, understood.
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
