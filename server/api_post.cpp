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

namespace cordillera::server {
namespace {

using Seconds = std::chrono::seconds;
constexpr int kLongestWait_s = 600;

/// A POST whose query and headers are in order.
struct Posting {
  Settings settings;
  std::string name;
  std::string key;  ///< Idempotency-Key, or empty
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
  auto settings = with_layer(service.settings(), build_options(), request.query, Spelling::query);
  if (!settings) return settings.problem();
  posting.settings = std::move(settings.value());
  if (auto refused = apply_policy(service.settings(), posting.settings.build)) return *refused;
  if (auto refused = check_headers(request, posting)) return *refused;
  if (auto refused = check_body(request, posting, std::uint64_t{service.settings().serve.body_limit_mib} << 20))
    return *refused;
  const std::string& name = posting.settings.build.name();
  posting.name = name.empty() ? "raster" : name;
  posting.options_hash = digest(to_json_line(posting.settings.build) + (posting.settings.dry_run ? "dry" : ""));
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

/// Waits until the dataset is ready or has failed, or the client's time is over.
void wait_for(Service& service, const std::string& id, Seconds longest) {
  const auto end = std::chrono::steady_clock::now() + longest;
  while (!service.stopping()) {
    const auto seen = service.hub().now(id).version;
    const auto dataset = service.registry().find(id);
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (!dataset || dataset->state == State::ready || dataset->state == State::failed || left.count() <= 0) return;
    service.hub().wait(id, seen, left);
  }
}

/// The answer to a POST whose dataset exists, at once or after the wait that the client prefers.
Response accepted(Service& service, const std::string& id, const Posting& posting) {
  Token waiting;
  if (posting.wait.count() > 0) {
    waiting = service.wait_token();
    if (waiting) wait_for(service, id, posting.wait);
  }
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

Response create(Service& service, const Posting& posting, Upload& upload) {
  Dataset dataset;
  dataset.id = make_id(posting.name);
  dataset.name = posting.name;
  dataset.options = posting.settings.build;
  dataset.created = now_text();
  dataset.raster = upload.raster();
  dataset.idempotency_key = posting.key;
  dataset.options_hash = posting.options_hash;
  dataset.body_hash = upload.body_hash();
  const auto place = service.layout().dataset(dataset.id);
  if (const auto kept = upload.keep(place); !kept) return problem_response(kept.problem());
  if (!service.registry().add(dataset)) {
    std::error_code ignored;
    std::filesystem::remove_all(place, ignored);
    return problem_response({"internal", "the dataset could not be registered", "trying again", ""});
  }
  log_info("dataset " + dataset.id + ": queued");
  service.queue().enqueue(dataset.id);
  return accepted(service, dataset.id, posting);
}

}  // namespace

std::optional<proto::Problem> check_post(Service& service, const Request& request) {
  const auto posting = read_posting(service, request);
  return posting ? std::nullopt : std::optional(posting.problem());
}

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
  Upload upload(service.layout(), suffix_of(posting->name));
  const std::uint64_t limit = std::uint64_t{service.settings().serve.body_limit_mib} << 20;
  if (const auto received = upload.receive(request, limit, posting->expected); !received) {
    return problem_response(received.problem());
  }
  if (earlier && earlier->body_hash != upload.body_hash()) return problem_response(key_reused("another raster"));
  if (posting->settings.dry_run) return dry_run(service, dry_job(*posting, upload), upload.folder());
  if (!earlier) return create(service, *posting, upload);
  key.reset();
  return accepted(service, earlier->id, *posting);
}

}  // namespace cordillera::server
