#include "server/api/requests/delivery.h"

#include <algorithm>

#include "proto/numbers.h"
#include "server/api/requests/prefer.h"
#include "server/fetch/addresses.h"
#include "server/http/json.h"
#include "server/options/option_values.h"
#include "server/uploads/tus.h"

namespace cordillera::server {
namespace {

constexpr std::chrono::seconds kLongestPost{600};
const std::string kKeyOfUpload = "upload ";

proto::Problem body_empty() {
  return {"body-empty", "the request has no body",
          "a raster as the body: curl --data-binary @dem.tif …; or source= with its address", ""};
}

/// "a.tif, https://…": addresses in a row. An address may have a comma of its own.
bool is_several(const std::string& addresses) {
  for (std::size_t comma = addresses.find(','); comma != addresses.npos; comma = addresses.find(',', comma + 1)) {
    const std::size_t next = addresses.find_first_not_of(" \t\n", comma + 1);
    if (next == addresses.npos) return false;
    const std::size_t end = addresses.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789", next);
    if (end > next && end != addresses.npos && addresses.compare(end, 3, "://") == 0) return true;
  }
  return false;
}

std::optional<proto::Problem> check_body(const Request& request, RasterIs raster, std::uint64_t limit, Delivery& delivery) {
  const bool bodiless = !request.header("transfer-encoding") && request.header("content-length").value_or("0") == "0";
  const char* elsewhere = !delivery.upload.empty() ? "upload" : !delivery.address.empty() ? "source" : "";
  if (*elsewhere != 0 || raster == RasterIs::optional) {
    if (bodiless) return std::nullopt;
    if (*elsewhere != 0) {
      return proto::Problem{"options-conflict", std::string(elsewhere) + "= names a raster, and the request has a body too",
                            "one of them", elsewhere};
    }
  }
  delivery.body = true;
  const std::string type = request.header("content-type").value_or("");
  if (type.starts_with("application/json")) return words_for_raster("JSON");
  if (type.starts_with("multipart/")) {
    return proto::Problem{"body-form", "the body is a multipart form; the raster itself is wanted, with nothing around it",
                          "curl --data-binary @dem.tif … (or -T dem.tif -X POST), not -F", ""};
  }
  const auto length = request.header("content-length");
  // A POST that announces neither has no body (RFC 9112, 6.3); waiting for one would only end with the connection.
  if (!length && !request.header("transfer-encoding")) return body_empty();
  if (!length) return std::nullopt;
  const auto bytes = proto::number<std::uint64_t>(*length);
  if (!bytes) return proto::Problem{"request-invalid", "Content-Length is not a number", "the number of bytes of the body", ""};
  if (*bytes == 0) return body_empty();
  if (*bytes > limit) {
    return proto::Problem{"body-too-large", "the body has " + *length + " bytes, more than this service takes",
                          "at most " + std::to_string(limit >> 20) + " MiB", ""};
  }
  if (!request.header("content-encoding")) delivery.expected = bytes;
  return std::nullopt;
}

/// What a query says of upload= and source=, as far as it can be wrong without a look at the service.
std::optional<proto::Problem> check_words(const RasterWords& words) {
  if (!words.upload.empty() && !words.address.empty()) {
    return proto::Problem{"options-conflict", "upload= and source= both name a raster", "one of them", "source"};
  }
  if (is_several(words.address)) return several_sources();
  if (words.upload.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") != words.upload.npos)
    return uploads::unknown_upload(words.upload);
  return std::nullopt;
}

}  // namespace

proto::Problem several_sources() {
  return {"option-invalid", "source names several rasters, and a POST takes one address",
          "the first alone, and POST /v1/datasets/{id}/sources?source=ADDRESS for each of the others; or the files in one form: "
          "curl -F file=@a.tif -F file=@b.tif",
          "source"};
}

proto::Problem words_for_raster(const std::string& what) {
  return {
      "body-form", "the body is " + what + "; the raster itself is wanted, with nothing around it",
      "a raster as the body: curl -T dem.tif -X POST …; or no body, and source=ADDRESS or upload=ID in the query, with options",
      ""};
}

std::uint64_t most_bytes(const Limits& limits) { return std::uint64_t{limits.body_mib} << 20; }

Request watched(const Request& request, limits::Space::Claim& claim, std::string* full) {
  Request watched = request;
  watched.read_body = [&request, &claim, full](const Request::Sink& sink) {
    return request.read_body && request.read_body([&](std::string_view piece) {
      *full = claim.next(piece.size());
      return full->empty() && sink(piece);
    });
  };
  return watched;
}

void Delivery::key_by_upload() {
  if (key.empty() && !upload.empty()) key = kKeyOfUpload + upload;
}

bool Delivery::is_keyed_by_upload() const { return !upload.empty() && key == kKeyOfUpload + upload; }

proto::Problem key_reused(const Delivery& delivery, const std::string& dataset, const std::string& what) {
  if (delivery.is_keyed_by_upload()) {
    return {"idempotency-key-reused", "the upload '" + delivery.upload + "' went into dataset " + dataset + ", with " + what,
            "the query of that request, or another upload", "upload"};
  }
  return {"idempotency-key-reused", "this Idempotency-Key was used with " + what, "a new key for a new request",
          "Idempotency-Key"};
}

proto::Problem key_in_use(const Delivery& delivery) {
  const bool by_upload = delivery.is_keyed_by_upload();
  return {"idempotency-key-in-use",
          std::string("a request with this ") + (by_upload ? "upload" : "Idempotency-Key") + " is under way",
          "trying again later", by_upload ? "upload" : "Idempotency-Key"};
}

std::optional<proto::Problem> read_headers(const Request& request, Delivery& delivery) {
  delivery.key = request.header("idempotency-key").value_or("");
  if (delivery.key.size() > 255 || !is_utf8(delivery.key)) {
    return proto::Problem{"option-invalid", "the Idempotency-Key is too long or not text", "up to 255 characters",
                          "Idempotency-Key"};
  }
  delivery.wait = std::min(preferred_wait(request).value_or(std::chrono::seconds(0)), kLongestPost);
  return std::nullopt;
}

std::optional<proto::Problem> check_delivery(const ServeSettings& settings, const Request& request, RasterIs raster,
                                             Delivery& delivery) {
  if (auto refused = check_words(delivery)) return refused;
  if (!delivery.address.empty()) {
    if (const auto allowed = updates::check_address(settings, delivery.address); !allowed) return allowed.problem();
  }
  if (auto refused = read_headers(request, delivery)) return refused;
  return check_body(request, raster, most_bytes(settings.limits), delivery);
}

proto::Result<void> take_raster(Service& service, const Delivery& delivery, const Request& request, Upload& upload) {
  if (!delivery.upload.empty()) {
    const auto whole = uploads::finished(service.uploads(), delivery.upload, request);
    return whole ? upload.adopt(service.uploads().bytes_of(delivery.upload)) : whole.problem();
  }
  if (!delivery.body) return {};
  std::string full;
  const auto claim = service.admission().space().claim(delivery.expected.value_or(0), &full);
  if (!claim) return limits::storage_full(full);
  auto received = upload.receive(watched(request, *claim, &full), most_bytes(service.settings().serve.limits), delivery.expected);
  return received || full.empty() ? received : limits::storage_full(full);
}

}  // namespace cordillera::server
