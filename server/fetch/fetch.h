#pragma once
// Rasters that a request names by their address: fetched by the service, for the process that builds has no network.
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "proto/result.h"
#include "server/limits/space.h"
#include "server/options/options.h"

namespace cordillera::server::updates {

/// Puts what stands at the address into a file, whole or not at all.
using Fetch = std::function<proto::Result<void>(const std::string& address, const std::filesystem::path& file,
                                                const std::atomic<bool>& stop)>;

/// Of http://, https:// and s3:// within the operator's list; redirects stay within it too. Problems: "source-unreachable",
/// "body-too-large", "storage-full", "cancelled".
Fetch fetcher(const ServeSettings& settings, limits::Space& space);

}  // namespace cordillera::server::updates
