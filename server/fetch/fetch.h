#pragma once
// Rasters that a request names by their address: fetched by the service, for the process that builds has no network.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "proto/result.h"
#include "server/limits/space.h"
#include "server/options/options.h"

namespace cordillera::server::updates {

/// What a server says of the bytes behind an address, to tell later whether they are still the same. Empty: it does not say.
struct Print {
  std::string etag, modified;
  std::uint64_t bytes = 0;
};

/// Puts what stands at the address into a file, whole or not at all.
using Fetch = std::function<proto::Result<Print>(const std::string& address, const std::filesystem::path& file,
                                                const std::atomic<bool>& stop)>;

/// Of http://, https:// and s3:// within the operator's list; redirects stay within it too. Problems: "source-unreachable",
/// "body-too-large", "storage-full", "cancelled".
Fetch fetcher(const ServeSettings& settings, limits::Space& space);

/// gone: it is not to be had any more, or the operator does not allow it any more. unknown: no answer that says so; and of s3://, which is not asked.
enum class Still : std::uint8_t { same, changed, gone, unknown };
/// Asks whether an address has what was fetched from it. Reads none of the raster. May take some seconds.
using Ask = std::function<Still(const std::string& address, const Print& print)>;
Ask asker(const ServeSettings& settings);

}  // namespace cordillera::server::updates
