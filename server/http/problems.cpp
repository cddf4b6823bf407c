#include "server/http/problems.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "proto/letters.h"

namespace cordillera::server {
namespace {

// What an answer may say.
const std::vector<ProblemKind>& table() {
  static const std::vector<ProblemKind> kinds = {
      {"body-empty", 400, "No raster was sent"},
      {"body-incomplete", 400, "The upload ended before its end"},
      {"body-stripped", 400, "The raster lost bytes on its way"},
      {"request-invalid", 400, "The request is not valid HTTP"},
      {"form-invalid", 400, "The form cannot be read"},
      {"option-unknown", 400, "Unknown option"},
      {"option-repeated", 400, "Option given twice"},
      {"option-invalid", 400, "Bad value of an option"},
      {"upload-invalid", 400, "The upload's headers cannot be read"},
      {"options-conflict", 400, "Options that exclude each other"},
      {"json-invalid", 400, "The body is not the JSON that was expected"},
      {"coding-invalid", 400, "The body is not in the coding that it names"},
      {"token-missing", 401, "A token is needed"},
      {"token-invalid", 401, "The token is not valid"},
      {"role-too-low", 403, "The token does not allow this"},
      {"origin-forbidden", 403, "Pages of other sites may not write"},
      {"option-forbidden", 403, "The operator does not allow this value"},
      {"not-found", 404, "No such resource"},
      {"dataset-unknown", 404, "No such dataset"},
      {"upload-unknown", 404, "No such upload"},
      {"source-unknown", 404, "The dataset has no such raster"},
      {"tile-unknown", 404, "No such tile"},
      {"not-in-folder", 404, "The folder of tiles does not hold it"},
      {"version-unknown", 404, "No such version of the dataset"},
      {"method-not-allowed", 405, "Method not allowed here"},
      {"request-timeout", 408, "The request took too long"},
      {"dataset-not-ready", 409, "The dataset is not ready"},
      {"dataset-fixed", 409, "The dataset's raster cannot be changed"},
      {"dataset-changing", 409, "Changes of the dataset are pending"},
      {"source-last", 409, "A dataset needs a raster"},
      {"dataset-failed", 409, "The dataset could not be built"},
      {"idempotency-key-in-use", 409, "A request with this Idempotency-Key or upload is under way"},
      {"upload-conflict", 409, "The upload stands elsewhere"},
      {"precondition-failed", 412, "The resource is not as the request's condition says"},
      {"tus-version", 412, "Another version of tus"},
      {"body-too-large", 413, "The body is too large"},
      {"uri-too-long", 414, "The address is too long"},
      {"body-form", 415, "A form or JSON instead of a raster"},
      {"coding-unknown", 415, "The body's compression is unknown"},
      {"upload-type", 415, "A part of an upload has a type of its own"},
      {"range-beyond", 416, "The Range begins behind the end"},
      {"idempotency-key-reused", 422, "The Idempotency-Key or upload belongs to another request"},
      {"build-time-limit", 422, "The build took longer than it may"},
      {"memory-limit", 422, "The build needs more memory than it may use"},
      {"mesh-too-large", 422, "The mesh is too large"},
      {"export-too-large", 422, "The archive is too large"},
      {"device-unavailable", 422, "The device cannot be used"},
      {"bbox-outside-raster", 422, "The box lies beside the data"},
      {"unit-unknown", 422, "The unit of the heights is not known"},
      {"hgt-name", 422, "The name of an .hgt does not say where it lies"},
      {"raster-format-unsupported", 422, "The raster's format is not read"},
      {"raster-truncated", 422, "The raster is not complete"},
      {"raster-unreadable", 422, "The raster cannot be read"},
      {"raster-too-large", 422, "The raster is too large"},
      {"raster-bands", 422, "The raster has no single band of heights"},
      {"raster-type", 422, "The raster's pixels are no heights"},
      {"raster-scale", 422, "The raster's scale gives no heights"},
      {"raster-all-nodata", 422, "The raster has no data"},
      {"raster-heights-out-of-range", 422, "The raster's heights are out of range"},
      {"raster-not-georeferenced", 422, "The raster does not say where it lies"},
      {"raster-without-crs", 422, "The raster names no coordinate system"},
      {"crs-unknown", 422, "The coordinate system is not known"},
      {"crs-unsupported", 422, "The coordinate system does not fit"},
      {"crs-conflict", 422, "The raster says another coordinate system or datum"},
      {"crs-mismatch", 422, "The coordinates do not fit the coordinate system"},
      {"crs-not-transformable", 422, "The raster's place cannot be taken to WGS 84"},
      {"geoid-not-found", 422, "The geoid grid is not installed"},
      {"geoid-invalid", 422, "The geoid grid cannot be read"},
      {"geoid-does-not-cover", 422, "The geoid grid does not cover the raster"},
      {"archive-rasters", 422, "The archive does not hold one raster"},
      {"archive-too-large", 422, "The archive unpacks to too much"},
      {"archive-unreadable", 422, "The archive cannot be unpacked"},
      {"too-many-connections", 429, "Too many connections of one client"},
      {"too-many-streams", 429, "Too many waiting requests of one client"},
      {"too-many-uploads", 429, "Too many uploads of one client"},
      {"head-too-large", 431, "The request's headers are too large"},
      {"source-unreachable", 422, "The raster's address cannot be fetched"},
      {"source-replaced", 422, "The raster's address has another raster"},
      {"job-crashed", 500, "The build's process ended abnormally"},
      {"internal", 500, "Something went wrong in the service"},
      {"store-damaged", 500, "What was built cannot be read, or is not what was written"},
      {"method-unknown", 501, "Unknown method"},
      {"crs-tables-unreadable", 503, "The tables of coordinate systems cannot be read"},
      {"service-stopping", 503, "The service is stopping"},
      {"not-ready", 503, "The service cannot take work"},
      {"queue-full", 503, "The queue of builds is full"},
      {"storage-unreachable", 503, "The dataset's storage does not give it"},
      {"archive-not-ready", 503, "The archive is being made"},
      {"tile-not-ready", 503, "The tile is still to be made"},
      {"service-busy", 503, "Too many clients are waiting"},
      {"http-version", 505, "Another version of HTTP"},
      {"datasets-full", 507, "No more datasets may be kept"},
      {"storage-full", 507, "No room left to store this"},
      {"store-write", 507, "The dataset cannot be written"},
  };
  return kinds;
}

/// What the commands that talk to a service say by themselves. No answer has these.
struct OwnTitle {
  std::string_view slug;
  const char* title;
};
constexpr OwnTitle kOfCommands[] = {
    {"usage", "That line is not understood"},
    {"config-invalid", "The config file cannot be read"},
    {"file-unreadable", "The file cannot be read"},
    {"output-failed", "The output cannot be written"},
    {"source-changed", "The file has changed meanwhile"},
    {"service-unreachable", "The service cannot be reached"},
    {"connection-broken", "The connection broke off"},
    {"answer-unknown", "That is no answer of a Cordillera service"},
    {"upload-running", "Another process is sending the file"},
};

constexpr int kOfNoRow = 422;

std::string title_of(std::string_view slug) {
  std::string title(slug);
  for (char& c : title) {
    if (c == '-') c = ' ';
  }
  if (!title.empty()) title[0] = proto::upper(title[0]);
  return title;
}

}  // namespace

ProblemKind problem_kind(std::string_view slug) {
  for (const ProblemKind& kind : table()) {
    if (kind.slug == slug) return kind;
  }
  for (const OwnTitle& own : kOfCommands) {
    if (own.slug == slug) return {std::string(slug), kOfNoRow, own.title};
  }
  return {std::string(slug), kOfNoRow, title_of(slug)};
}

bool is_of_commands(std::string_view slug) {
  return std::any_of(std::begin(kOfCommands), std::end(kOfCommands), [&](const OwnTitle& own) { return own.slug == slug; });
}

std::vector<ProblemKind> all_problem_kinds() { return table(); }

}  // namespace cordillera::server
