#pragma once
// Addresses that rasters are fetched from: which are allowed, what of them is shown, and where redirects lead.
#include <optional>
#include <string>
#include <utility>

#include "proto/result.h"
#include "server/options/options.h"

namespace cordillera::server::updates {

/// "https://host:1/a?b#c" -> "https://host:1" and what a request asks that host for, "/a?b".
std::pair<std::string, std::string> host_and_target(const std::string& address);

inline constexpr int kMostRedirects = 5;  ///< that are followed, each within what the operator allows

/// What of an address anybody may see: its query, and what stands behind a ";" in its path, may be a signature that opens it.
std::string without_query(const std::string& address);

/// Where a redirect of an address leads (RFC 3986, 5.2), without "." and "..": what is checked is what is asked for. location: as
/// it was sent. Its escapes stay as they are; blanks and what is beyond ASCII, which stand in no address, get some.
std::string resolved(const std::string& address, const std::string& location);

/// What a GET asks for to have what stands at an address: of s3:// the object by HTTP, signed for an hour; else the address.
/// nullopt: the storage signs nothing.
std::optional<std::string> http_address(const std::string& address);

/// Whether the operator lets it be fetched.
proto::Result<void> check_address(const ServeSettings& settings, const std::string& address);

/// Where a redirect of an address leads, if it may be followed: to http or https, and where the operator lets rasters be fetched
/// from. Problems: "option-forbidden", "source-unreachable".
proto::Result<std::string> led_to(const ServeSettings& settings, const std::string& address, const std::string& location);

/// Of s3://: its path for GDAL.
std::string object_path(const std::string& address);
inline bool is_object(const std::string& address) { return address.starts_with("s3://"); }

/// "source-unreachable", with why.
proto::Problem unreachable(const std::string& address, const std::string& why);

}  // namespace cordillera::server::updates
