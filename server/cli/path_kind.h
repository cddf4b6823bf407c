#pragma once
// What a path of the command line names.
#include <cstdint>
#include <optional>
#include <string>

#include "proto/result.h"

namespace cordillera::server {

enum class PathKind : std::uint8_t {
  missing,
  raster,  ///< a file that is no dataset; whether GDAL reads it is found out later
  store,   ///< a dataset's .sqlite file
  folder,
};
PathKind path_kind(const std::string& path);
/// A path that is closed to whoever runs this, or a folder that is: nothing can be said of what is there, not even that it is
/// missing.
std::optional<proto::Problem> refuse_closed(const std::string& path, const std::string& parameter);

/// A folder that was not built, but has rasters to build of.
bool holds_rasters(const std::string& path);

/// dem.tif, out.zip: who says so means a file, unless such a folder is there or a slash says that it is one.
bool means_another_file(const std::string& output);
/// Its refusal by a command that writes folders, datasets and what export writes.
proto::Problem no_such_file(const std::string& command, const std::string& output);

/// Another process of this program writes there now: what it does is left alone.
proto::Problem at_work_there(const std::string& place);

}  // namespace cordillera::server
