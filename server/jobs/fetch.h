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

/// What of an address anybody may see: its query, and what stands behind a ";" in its path, may be a signature that opens it.
std::string without_query(const std::string& address);

/// Where a redirect of an address leads (RFC 3986, 5.2), without "." and "..": what is checked is what is asked for.
std::string resolved(const std::string& address, const std::string& location);

/// Whether the operator lets it be fetched.
proto::Result<void> check_address(const ServeSettings& settings, const std::string& address);

}  // namespace cordillera::server::updates
