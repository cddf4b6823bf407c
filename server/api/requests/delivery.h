#pragma once
// How a raster comes with a request: as its body, as an upload that arrived in parts, or by its address.
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/api/requests/query_words.h"
#include "server/datasets/upload.h"
#include "server/service/service.h"

namespace cordillera::server {

struct Delivery : RasterWords {
  std::string key;                          ///< Idempotency-Key, or that of the upload, or empty
  bool body = false;                        ///< it is the body
  std::chrono::seconds wait{0};             ///< Prefer: wait
  std::optional<std::uint64_t> expected{};  ///< bytes of the body, if that is known
  bool any() const { return body || !upload.empty() || !address.empty(); }

  /// A client that was cut off asks again: an upload becomes one thing, also without a key.
  void key_by_upload();
  bool is_keyed_by_upload() const;
};

enum class RasterIs { needed, optional };

/// A POST fetches one raster.
proto::Problem several_sources();
/// 415: where a raster is to come stand words, which belong into the query. what: that they are.
proto::Problem words_for_raster(const std::string& what);
/// Idempotency-Key and Prefer.
std::optional<proto::Problem> read_headers(const Request& request, Delivery& delivery);
/// Reads the headers, and checks that what the query names and what was announced may come.
std::optional<proto::Problem> check_delivery(const ServeSettings& settings, const Request& request, RasterIs raster,
                                             Delivery& delivery);
/// The largest body that the operator takes.
std::uint64_t most_bytes(const Limits& limits);

/// The raster into the upload, from the body or from the parts. Nothing where it is to be fetched.
proto::Result<void> take_raster(Service& service, const Delivery& delivery, const Request& request, Upload& upload);

/// The request, but its body ends early when the disk has no room for more of it; full then says why. It must outlive the one
/// that comes.
Request watched(const Request& request, limits::Space::Claim& claim, std::string* full);

/// 422: the key belongs to another request, or the upload without one. dataset: what came of that; what: it was used with.
proto::Problem key_reused(const Delivery& delivery, const std::string& dataset, const std::string& what);
/// 409: another request with it has not been answered.
proto::Problem key_in_use(const Delivery& delivery);

}  // namespace cordillera::server
