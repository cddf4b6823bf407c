#pragma once
// The child's side: the version that target.json describes, built into next.sqlite.
#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "pipeline/build/build.h"

namespace cordillera::server::updates {

/// What the operator lets a raster have; nullopt: it may.
using SizeCheck = std::function<std::optional<proto::Problem>(const std::string& name, const proto::Source& source)>;

/// Paths of rasters count from the folder, which becomes the process's own: a folder that was moved has the same keys of tasks.
proto::Result<proto::Manifest> build_target(const proto::Job& job, const std::filesystem::path& folder,
                                            const SizeCheck& too_large, const pipeline::ProgressCallback& progress,
                                            const std::atomic<bool>& stop);

}  // namespace cordillera::server::updates
