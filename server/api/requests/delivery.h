#pragma once
// How a raster comes with a request: as its body, as an upload that arrived in parts, or by its address.
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/datasets/upload.h"
#include "server/options/options.h"
#include "server/service/service.h"

namespace cordillera::server {

struct Delivery {
  std::string key;                          ///< Idempotency-Key, or empty
  std::string upload;                       ///< id of an upload that arrived in parts
  std::string address;                      ///< that the service is to fetch it from
  bool body = false;                        ///< it is the body
  std::chrono::seconds wait{0};             ///< Prefer: wait
  std::optional<std::uint64_t> expected{};  ///< bytes of the body, if that is known
  bool any() const { return body || !upload.empty() || !address.empty(); }
};

enum class RasterIs { needed, optional };

/// Takes upload= and source= out of the query; gives the other parameters.
proto::Result<Given> other_parameters(const Request& request, Delivery& delivery);
/// All that a POST takes, its upload=, source= and updates= among them, as problems list it.
std::string post_names();
/// The first of options that came in a body and that a POST does not have. kind: what it is there, "member" of JSON, "field" of a
/// form.
std::optional<proto::Problem> unknown_in_body(const Given& options, const std::string& kind);
/// A POST fetches one raster.
proto::Problem several_sources();
/// Reads the headers, and checks that what was announced may come.
std::optional<proto::Problem> check_delivery(const ServeSettings& settings, const Request& request, RasterIs raster,
                                             Delivery& delivery);
/// The largest body that the operator takes.
std::uint64_t most_bytes(const Limits& limits);

/// The raster into the upload, from the body or from the parts. Nothing where it is to be fetched.
proto::Result<void> take_raster(Service& service, const Delivery& delivery, const Request& request, Upload& upload);

/// The request, but its body ends early when the disk has no room for more of it; full then says why. It must outlive the one
/// that comes.
Request watched(const Request& request, limits::Space::Claim& claim, std::string* full);

/// 422: the key belongs to another request. what: that it was used with.
proto::Problem key_reused(const std::string& what);

}  // namespace cordillera::server
