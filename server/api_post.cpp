// POST /v1/datasets: check, stream to disk, queue, and wait if the client prefers to.
#include <charconv>
#include <chrono>
#include <ctime>

#include "server/api.h"
#include "server/digest.h"
#include "server/json.h"
#include "server/log.h"
#include "server/request_policy.h"
#include "server/upload.h"
#include "server/uploads/tus.h"

namespace cordillera::server {
namespace {

using Seconds = std::chrono::seconds;
constexpr int kLongestWait_s = 600;

/// A POST whose query and headers are in order.
struct Posting {
  Settings settings;
  std::string name;
  std::string key;  ///< Idempotency-Key, or empty
  std::string upload;  ///< id of an upload that arrived in parts; empty: the raster is the body
  std::string options_hash;
  Seconds wait{0};
  std::optional<std::uint64_t> expected;  ///< bytes of the body, if that is known
};

proto::Problem body_empty() {
  return {"body-empty", "the request has no body", "a raster as the body: curl --data-binary @dem.tif …", ""};
}

template <class T>
std::optional<T> digits(std::string_view text) {
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

std::optional<proto::Problem> check_body(const Request& request, Posting& posting, std::uint64_t limit) {
  const bool bodiless = !request.header("transfer-encoding") && request.header("content-length").value_or("0") == "0";
  if (!posting.upload.empty()) {
    if (bodiless) return std::nullopt;
    return proto::Problem{"options-conflict", "upload= names a raster that is here, and the request has a body too", "one of them", "upload"};
  }
  if (request.header("content-type").value_or("").rfind("multipart/", 0) == 0) {
    return proto::Problem{"body-form", "the body is a multipart form; the raster itself is wanted, with nothing around it",
                          "curl --data-binary @dem.tif … (or -T dem.tif -X POST), not -F", ""};
  }
  const auto length = request.header("content-length");
  // A POST that announces neither has no body (RFC 9112, 6.3); waiting for one would only end with the connection.
  if (!length && !request.header("transfer-encoding")) return body_empty();
  if (!length) return std::nullopt;
  const auto bytes = digits<std::uint64_t>(*length);
  if (!bytes) return proto::Problem{"request-invalid", "Content-Length is not a number", "the number of bytes of the body", ""};
  if (*bytes == 0) return body_empty();
  if (*bytes > limit) {
    return proto::Problem{"body-too-large", "the body has " + *length + " bytes, more than this service takes",
                          "at most " + std::to_string(limit >> 20) + " MiB", ""};
  }
  if (!request.header("content-encoding")) posting.expected = bytes;
  return std::nullopt;
}

std::optional<proto::Problem> check_headers(const Request& request, Posting& posting) {
  posting.key = request.header("idempotency-key").value_or("");
  if (posting.key.size() > 255 || !is_utf8(posting.key)) {
    return proto::Problem{"option-invalid", "the Idempotency-Key is too long or not text", "up to 255 characters",
                          "Idempotency-Key"};
  }
  const std::string prefer = request.header("prefer").value_or("");
  const auto wait = prefer.find("wait=");
  if (wait == std::string::npos) return std::nullopt;
  const auto first = wait + 5;
  const auto seconds =
      digits<int>(std::string_view(prefer).substr(first, prefer.find_first_not_of("0123456789", first) - first));
  if (!seconds || *seconds < 0) {
    return proto::Problem{"option-invalid", "Prefer: wait names no number of seconds", "wait=SECONDS", "Prefer"};
  }
  posting.wait = Seconds(std::min(*seconds, kLongestWait_s));
  return std::nullopt;
}

proto::Result<Posting> read_posting(Service& service, const Request& request) {
  Posting posting;
  Given options;
  for (const auto& [name, value] : request.query) {
    if (name != "upload") options.emplace_back(name, value);
    else if (posting.upload.empty()) posting.upload = value;
    else return proto::Problem{"option-repeated", "upload is given twice", "one upload", "upload"};
    if (name == "upload" && value.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") != value.npos) return uploads::unknown_upload(value);
  }
  auto settings = with_layer(service.settings(), post_options(), options, Spelling::query);
  if (!settings) return settings.problem();
  posting.settings = std::move(settings.value());
  if (posting.settings.private_dataset && !service.gate().has_tokens()) {
    return proto::Problem{"option-forbidden", "private: this service was started without tokens, so everybody may read", "private=0, or cordillera serve --tokens FILE",
                          "private"};
  }
  if (auto refused = apply_policy(service.settings(), posting.settings.build)) return *refused;
  if (auto refused = check_headers(request, posting)) return *refused;
  if (auto refused = check_body(request, posting, std::uint64_t{service.settings().serve.limits.body_mib} << 20))
    return *refused;
  const std::string& name = posting.settings.build.name();
  posting.name = name.empty() ? "raster" : name;
  if (!posting.upload.empty()) {
    const auto begun = service.uploads().find(posting.upload);
    if (name.empty() && begun && !begun->name.empty()) posting.name = begun->name;
    // A client that was cut off asks again: an upload becomes one dataset.
    if (posting.key.empty() && !posting.settings.dry_run) posting.key = "upload " + posting.upload;
  }
  posting.options_hash = digest(to_json_line(posting.settings.build) + (posting.settings.dry_run ? "dry" : "") +
                                (posting.settings.private_dataset ? "private" : ""));
  return posting;
}

proto::Problem key_reused(const std::string& what) {
  return {"idempotency-key-reused", "this Idempotency-Key was used with " + what, "a new key for a new request",
          "Idempotency-Key"};
}

std::string now_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

proto::Job dry_job(const Posting& posting, const Upload& upload) {
  proto::Job job;
  job.set_id("dry-run");
  job.set_name(posting.name);
  job.set_raster(upload.raster());
  job.set_dry_run(true);
  *job.mutable_options() = posting.settings.build;
  return job;
}

bool is_built(Service& service, const std::string& id) {
  const auto dataset = service.registry().find(id);
  return !dataset || dataset->state == State::ready || dataset->state == State::failed;
}

/// The answer to a POST whose dataset exists, as it is now.
Response answer_now(Service& service, const std::string& id, const Posting& posting, const Token& waiting) {
  const auto dataset = service.registry().find(id);
  if (!dataset) return problem_response(unknown_dataset(id));
  const bool failed = posting.wait.count() > 0 && dataset->state == State::failed && dataset->problem;
  Response response =
      failed ? problem_response(*dataset->problem)
             : json_response(dataset->state == State::ready ? 201 : 202, status_json(service, *dataset, "datasets/" + id));
  response.set("Location", "datasets/" + id);
  if (waiting) response.set("Preference-Applied", "wait=" + std::to_string(posting.wait.count()));
  return response;
}

/// The same, at once or after the wait that the client prefers.
Response accepted(Service& service, const std::string& id, const Posting& posting) {
  const Token waiting = posting.wait.count() > 0 ? service.wait_token() : nullptr;
  if (!waiting) return answer_now(service, id, posting, nullptr);
  Response response;
  response.later = [&service, id, posting, waiting, end = std::chrono::steady_clock::now() + posting.wait]() -> std::optional<Response> {
    if (!service.stopping() && std::chrono::steady_clock::now() < end && !is_built(service, id)) return std::nullopt;
    return answer_now(service, id, posting, waiting);
  };
  return response;
}

/// Who sends, as far as uploads are counted.
std::string sender(const Request& request) { return request.who.name.empty() ? request.client : "token " + request.who.name; }

/// The request, but its body ends early when the disk has no more room: the length of a chunked or compressed one is not known before.
Request watched(const Request& request, const limits::Admission& admission, std::string* full) {
  constexpr std::uint64_t kLook = std::uint64_t{64} << 20;
  Request watched = request;
  watched.read_body = [&request, &admission, full](const Request::Sink& sink) {
    std::uint64_t since = 0;
    return request.read_body && request.read_body([&](std::string_view piece) {
      since += piece.size();
      if (since >= kLook) {
        since = 0;
        *full = admission.disk_full(0);
      }
      return full->empty() && sink(piece);
    });
  };
  return watched;
}

/// Adds the row, or removes the raster again: a disk that is full must not stay so for an upload that was refused.
bool registered(Service& service, const Dataset& dataset) {
  try {
    return service.registry().add(dataset);
  } catch (const RegistryError&) {
    // A row that is there all the same, in a log that could not be synced, keeps its raster.
    if (service.registry().find(dataset.id)) throw;
    std::error_code ignored;
    std::filesystem::remove_all(service.layout().dataset(dataset.id), ignored);
    throw;
  }
}

/// The raster into the upload: from the body, or from what arrived in parts.
proto::Result<void> take_raster(Service& service, const Posting& posting, const Request& request, Upload& upload) {
  if (!posting.upload.empty()) {
    const auto whole = uploads::finished(service.uploads(), posting.upload, request);
    return whole ? upload.adopt(service.uploads().bytes_of(posting.upload)) : whole.problem();
  }
  const std::uint64_t limit = std::uint64_t{service.settings().serve.limits.body_mib} << 20;
  std::string full;
  auto received = upload.receive(watched(request, service.admission(), &full), limit, posting.expected);
  if (received || full.empty()) return received;
  return proto::Problem{"storage-full", full, "a smaller raster, or posting when there is room again", ""};
}

Response create(Service& service, const Posting& posting, Upload& upload, const Request& request, limits::Place slot) {
  Dataset dataset;
  dataset.id = make_id(posting.name);
  dataset.name = posting.name;
  dataset.options = posting.settings.build;
  dataset.created = now_text();
  dataset.raster = upload.raster();
  dataset.idempotency_key = posting.key;
  dataset.options_hash = posting.options_hash;
  dataset.body_hash = upload.body_hash();
  dataset.owner = request.who.name;
  dataset.is_private = posting.settings.private_dataset;
  dataset.request_id = request.id;
  const auto place = service.layout().dataset(dataset.id);
  if (const auto kept = upload.keep(place); !kept) return problem_response(kept.problem());
  if (!registered(service, dataset)) {
    std::error_code ignored;
    std::filesystem::remove_all(place, ignored);
    return problem_response({"internal", "the dataset could not be registered", "trying again", ""});
  }
  log_info("dataset " + dataset.id + ": queued", {{"job", dataset.id}});
  service.queue().enqueue(dataset.id);
  slot.reset();  // the dataset counts for itself now
  if (!posting.upload.empty()) service.uploads().remove(posting.upload);
  return accepted(service, dataset.id, posting);
}

}  // namespace

Response post_dataset(Service& service, const Request& request) {
  const auto posting = read_posting(service, request);
  if (!posting) return problem_response(posting.problem());
  Token key;
  std::optional<Dataset> earlier;
  if (!posting->key.empty()) {
    key = service.key_token(posting->key);
    if (!key) {
      return problem_response({"idempotency-key-in-use", "a request with this Idempotency-Key is under way",
                               "trying again later", "Idempotency-Key"});
    }
    earlier = service.registry().find_by_key(posting->key);
    if (earlier && earlier->options_hash != posting->options_hash) return problem_response(key_reused("other options"));
  }
  auto place = service.admission().enter(sender(request), posting->expected, earlier ? limits::Entry::again : limits::Entry::fresh);
  if (!place) return problem_response(place.problem());
  Upload upload(service.layout(), suffix_of(posting->name));
  if (earlier && !posting->upload.empty() && !service.uploads().find(posting->upload)) {
    place->reset();
    key.reset();
    return accepted(service, earlier->id, *posting);  // made of this very upload
  }
  if (const auto taken = take_raster(service, *posting, request, upload); !taken) return problem_response(taken.problem());
  if (earlier && earlier->body_hash != upload.body_hash()) return problem_response(key_reused("another raster"));
  if (posting->settings.dry_run) return dry_run(service, dry_job(*posting, upload), upload.folder());
  if (!earlier) return create(service, *posting, upload, request, std::move(*place));
  place->reset();
  key.reset();
  return accepted(service, earlier->id, *posting);
}

}  // namespace cordillera::server
