#pragma once
// Rasters that a request names by their address: fetched by the service, for the process that builds has no network.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "proto/result.h"
#include "server/fetch/print.h"
#include "server/fetch/ranged_sources.h"
#include "server/limits/space.h"
#include "server/options/options.h"

namespace cordillera::server::updates {

/// Fetches rasters from http://, https:// and s3:// addresses within the operator's list; redirects stay within it too. Problems:
/// "source-unreachable", "body-too-large", "storage-full", "cancelled".
struct Fetch {
  using Into = std::function<proto::Result<Print>(const std::string& address, const std::filesystem::path& file,
                                                  const std::atomic<bool>& stop)>;
  Into whole;      ///< puts what stands at the address into a file, whole or not at all
  Into beginning;  ///< the same; of a TIFF whose host sends parts the beginning alone, with a map beside it (Print::ranged)
  RangedSources::Open rest;                                                ///< of such a one, as it is asked for
  std::function<proto::Result<void>(const std::string& address)> allowed;  ///< check_address
};
/// grace: how long a host may be waited for before its bytes have to come as fast as a client's (min-rate).
Fetch fetcher(const ServeSettings& settings, limits::Space& space, std::chrono::milliseconds grace = std::chrono::seconds(10));

/// gone: it is not to be had any more, or the operator does not allow it any more. unknown: no answer that says so; and of
/// an object of s3:// whose storage signs no addresses.
enum class Still : std::uint8_t { same, changed, gone, unknown };
/// Asks whether an address has what was fetched from it. Reads none of the raster. May take some seconds; stopped: asked a few
/// times a second, true ends it as "unknown".
using Ask = std::function<Still(const std::string& address, const Print& print, const std::function<bool()>& stopped)>;
Ask asker(const ServeSettings& settings);

}  // namespace cordillera::server::updates
