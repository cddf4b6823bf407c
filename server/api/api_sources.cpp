// …/sources: the rasters of a dataset, and what changes them. A change is written down before its 202; the queue then makes a
// version of it.
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "pipeline/store/sqlite.h"
#include "pipeline/work/update.h"
#include "raster/disk/write_all.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/change_request.h"
#include "server/api/public_address.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/datasets/ledger.h"
#include "server/http/conditions.h"
#include "server/jobs/source_json.h"
#include "server/log/log.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

const char* state_of(const proto::SourceChanges& changes, const std::string& id) {
  for (const proto::SourceChange& change : changes.ended()) {
    if (change.id() == id) return change.has_problem() ? "failed" : "done";
  }
  for (const proto::SourceChange& change : changes.pending()) {
    if (change.id() == id) return "pending";
  }
  return "forgotten";
}

/// The change as it is now, with its problem if it failed.
std::optional<proto::SourceChange> change_in(const proto::SourceChanges& changes, const std::string& id) {
  for (const auto* list : {&changes.ended(), &changes.pending()}) {
    for (const proto::SourceChange& change : *list) {
      if (change.id() == id) return change;
    }
  }
  return std::nullopt;
}

/// A signed address opens what it names, so only who may change the dataset sees it. Without tokens nobody can be told from a
/// stranger.
Shown shown_to(const Request& request, const Dataset& dataset) {
  return !request.who.name.empty() && !refuse(request, dataset) ? Shown::whole : Shown::without_query;
}

Json sources_json(Ledger& ledger, const fs::path& store, const std::string& id, Shown address) {
  const proto::SourceChanges changes = ledger.read(id);
  const proto::DatasetVersion version = ledger.current(id);
  const auto plan = pipeline::work::plan_in(store.string());
  Json json;
  json["version"] = version.number();
  if (plan) json["block_level"] = plan->plan().block_level();
  json["sources"] = Json::array();
  for (int k = 0; k < version.sources_size(); ++k) {
    const std::string& path = version.sources(k).spec().path();
    const proto::Source* found = nullptr;
    for (int at = 0; plan && at < plan->sources_size(); ++at)
      if (plan->sources(at).spec().path() == path) found = &plan->sources(at).description();
    json["sources"].push_back(source_json(version.sources(k), k, found, address));
    if (plan && found == nullptr) json["sources"].back()["beside_bbox"] = true;
  }
  json["changes"] = Json::array();
  for (const proto::SourceChange& change : changes.ended())
    json["changes"].push_back(change_json(change, state_of(changes, change.id())));
  for (const proto::SourceChange& change : changes.pending()) json["changes"].push_back(change_json(change, "pending"));
  return json;
}

/// Of a dataset of one raster for good: what its manifest says of it.
Json fixed_json(const proto::Manifest& manifest) {
  Json json;
  json["version"] = 1;
  json["sources"] = Json::array();
  const auto add = [&](const proto::Source& source) {
    proto::DatasetSource plain;
    plain.mutable_spec()->set_name(source.file());
    Json one = source_json(plain, static_cast<int>(json["sources"].size()), &source, Shown::without_query);
    for (const char* unknown : {"id", "bytes", "added", "options"}) one.erase(unknown);
    json["sources"].push_back(std::move(one));
  };
  for (const proto::Source& source : manifest.sources()) add(source);
  if (manifest.sources().empty()) add(manifest.source());
  json["changes"] = Json::array();
  return json;
}

Response listed(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  Json json;
  if (service.ledger().holds(dataset.id)) {
    json = sources_json(service.ledger(), service.layout().store(dataset.id), dataset.id, shown_to(request, dataset));
  } else {
    const Opened opened = open_published(service, dataset, {});
    if (!opened.terrain) return opened.refusal;
    json = fixed_json(opened.terrain->manifest());
  }
  if (route.item.empty()) return guarded_json(std::move(json));
  for (Json& one : json["sources"]) {
    if (one.value("id", "") != route.item) continue;
    // Its tag is another one from when a change is accepted.
    one["changes"] = Json::array();
    for (Json& change : json["changes"])
      if (change["source"] == route.item && change["state"] == "pending") one["changes"].push_back(std::move(change));
    return guarded_json(std::move(one));
  }
  return problem_response(unknown_source(dataset, route.item));
}

/// Of one that failed nothing was kept, whatever it was posted with.
Problem nothing_to_change(const Dataset& dataset) {
  const std::string why = dataset.problem ? dataset.problem->detail : "its build failed";
  return {"dataset-failed", "dataset " + dataset.id + " has nothing to change: " + why,
          "posting its rasters anew, with updates=1", ""};
}

/// How a change is answered: the status of one that is done, and the dataset's path as the client sees it.
struct Reply {
  int good;
  std::string path;
};

/// The answer to a change that is noted, as it is now.
Response answer_now(Service& service, const Dataset& dataset, const std::string& change_id, const Reply& reply) try {
  const proto::SourceChanges changes = service.ledger().read(dataset.id);
  const auto change = change_in(changes, change_id);
  if (!change) {  // deleted, or the first version failed, and this change with it
    const Row now = service.registry().find(dataset.id);
    return problem_response(now && now->state == State::failed ? nothing_to_change(*now) : unknown_dataset(dataset.id));
  }
  const std::string state = state_of(changes, change_id);
  if (state == "failed") return problem_response(to_problem(change->problem()));
  Response response = json_response(state == "done" ? reply.good : 202, change_json(*change, state.c_str()));
  if (change->kind() != "remove") response.set("Location", reply.path + "/sources/" + change->source().id());
  response.set("Cache-Control", "no-store");
  return response;
} catch (const pipeline::StoreError& error) {  // who waits is beyond the request that would say so
  return problem_response(service.library().damaged(dataset.id, error.what()));
}

/// The change has not come to its end, as far as the list can be read.
bool is_pending(Ledger& ledger, const std::string& id, const std::string& change) try {
  return state_of(ledger.read(id), change) == std::string("pending");
} catch (const pipeline::StoreError&) { return false; }

Response accepted(Service& service, const Dataset& dataset, const std::string& change, const Delivery& delivery,
                  const Reply& reply) {
  const Token waiting = delivery.wait.count() > 0 ? service.wait_token() : nullptr;
  if (!waiting) return answer_now(service, dataset, change, reply);
  Response response;
  response.later = [&service, dataset, change, waiting, reply, wait = delivery.wait,
                    end = std::chrono::steady_clock::now() + delivery.wait](Patience patience) -> std::optional<Response> {
    const bool over = patience == Patience::none || service.stopping() || std::chrono::steady_clock::now() >= end;
    if (!over && is_pending(service.ledger(), dataset.id, change)) return std::nullopt;
    Response come = answer_now(service, dataset, change, reply);
    come.set("Preference-Applied", "wait=" + std::to_string(wait.count()));
    return come;
  };
  return response;
}

/// The change that an earlier request with this key came to; nullopt: none. A problem: another request had it.
proto::Result<std::optional<proto::SourceChange>> earlier(Ledger& ledger, const std::string& id, const ChangeRequest& asked) {
  const proto::SourceChange& now = asked.change;
  if (now.idempotency_key().empty()) return std::optional<proto::SourceChange>();
  const proto::SourceChanges changes = ledger.read(id);
  const auto request = request_with(now.idempotency_key(), changes);
  if (request && *request != now.request_hash()) return key_reused(asked.delivery, id, "another request");
  for (const auto* list : {&changes.ended(), &changes.pending()}) {
    for (const proto::SourceChange& change : *list)
      if (change.idempotency_key() == now.idempotency_key()) return std::optional(change);
  }
  return std::optional<proto::SourceChange>();
}

/// From the upload's folder into the dataset's.
proto::Result<void> bring(const Upload& upload, const fs::path& place) {
  std::error_code error;
  fs::create_directories(place.parent_path(), error);
  if (!error && raster::put_in_place(upload.folder() / upload.raster(), place)) return {};
  const std::string why = error ? error.message() : std::strerror(errno);
  return Problem{"storage-full", "the raster cannot be put into its place: " + why, "", ""};
}

/// Why it is not made: what it is of is by now not as its If-Match has it.
std::optional<Problem> overtaken(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  if (!request.headers.contains("if-match")) return std::nullopt;
  const Response now = listed(service, request, dataset, route);
  if (now.status == 404 || if_match_holds(request, now.header("ETag"))) return std::nullopt;
  return condition_failed("If-Match", now.header("ETag"));
}

/// The request, as long as its body may be a raster. What curl -d sends is none; curl --data-binary says the same type of one.
proto::Result<Request> without_words(const Request& request) {
  if (!request.header("content-type").value_or("").starts_with("application/x-www-form-urlencoded")) return request;
  auto read = with_typed_body_as_query(request);
  if (read && (read->read_body || !request.read_body)) return read;
  return words_for_raster("JSON or fields of a form");
}

Response changed(Service& service, const Request& sent, const Dataset& dataset, const Route& route) {
  if (auto refused = refuse(sent, dataset)) return problem_response(*refused);
  const auto raster = without_words(sent);
  if (!raster) return problem_response(raster.problem());
  const Request& request = *raster;
  const Reply good{request.method == "POST" ? 201 : 200, public_path(request, dataset.id)};
  auto asked = read_change(service, request, dataset, route);
  if (!asked) return problem_response(asked.problem());
  Token key;
  if (!asked->delivery.key.empty() && !(key = service.key_token(request.who.name, dataset.id + " " + asked->delivery.key)))
    return problem_response(key_in_use(asked->delivery));
  const auto before = earlier(service.ledger(), dataset.id, *asked);
  if (!before) return problem_response(before.problem());
  if (!*before && !asked->known) return problem_response(unknown_source(dataset, route.item));
  if (*before && !asked->delivery.upload.empty() && !service.uploads().find(asked->delivery.upload)) {
    return accepted(service, dataset, (*before)->id(), asked->delivery, good);  // made of this very upload
  }
  auto place = service.admission().enter(sender(request), asked->delivery.expected, limits::Entry::again);
  if (!place) return problem_response(place.problem());
  proto::DatasetSource& source = *asked->change.mutable_source();
  Upload upload(service.layout(), suffix_of(source.spec().name()));
  if (const auto taken = take_raster(service, asked->delivery, request, upload); !taken) return problem_response(taken.problem());
  if (*before) {
    if ((*before)->source().hash() != upload.body_hash() && (*before)->source().url().empty())
      return problem_response(key_reused(asked->delivery, dataset.id, "another raster"));
    return accepted(service, dataset, (*before)->id(), asked->delivery, good);
  }
  source.set_hash(upload.body_hash());
  const bool here = !upload.body_hash().empty();
  std::error_code error;
  if (here) source.set_bytes(static_cast<double>(fs::file_size(upload.folder() / upload.raster(), error)));
  const fs::path file = service.layout().dataset(dataset.id) / source.spec().path();
  // Another request may have been faster while the raster came. One at a time, so that of two with one tag the second is told.
  auto alone = service.ledger().alone(dataset.id);
  if (auto late = overtaken(service, request, dataset, route)) return problem_response(*late);
  const auto noted =
      service.ledger().add(dataset.id, asked->change, service.settings().serve.limits.queue, [&]() -> proto::Result<void> {
        if (!service.registry().find(dataset.id)) return unknown_dataset(dataset.id);  // deleted while the raster came
        return here ? bring(upload, file) : proto::Result<void>();
      });
  alone.unlock();
  if (!noted) return problem_response(noted.problem());
  log_info("dataset " + dataset.id + ": version " + std::to_string(noted->number()) + " queued", {{"job", dataset.id}});
  service.queue().enqueue(dataset.id, sender(request));
  service.hub().touch(dataset.id);
  if (!asked->delivery.upload.empty()) service.uploads().remove(asked->delivery.upload);
  return accepted(service, dataset, noted->id(), asked->delivery, good);
}

}  // namespace

bool is_repeated(Service& service, const Request& request, const Dataset& dataset) try {
  const std::string key = own_key(request, request.header("idempotency-key").value_or(""));
  return !key.empty() && request_with(key, service.ledger().read(dataset.id)) == hash_of(request);
} catch (const pipeline::StoreError&) { return false; }

Problem unknown_source(const Dataset& dataset, const std::string& source) {
  return {"source-unknown", "dataset " + dataset.id + " has no raster '" + source + "'", "an id that GET …/sources lists", ""};
}

std::optional<Problem> refuse(const Request& request, const Dataset& dataset) {
  if (request.who.role >= access::Role::admin || dataset.owner == request.who.name) return std::nullopt;
  return Problem{"role-too-low", "the token '" + request.who.name + "' did not post dataset " + dataset.id,
                 "the token that did, or one with the role admin", "Authorization"};
}

Response sources(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  if (request.method == "GET" || request.method == "HEAD") return listed(service, request, dataset, route);
  if (!service.ledger().holds(dataset.id)) {
    if (dataset.state == State::failed) return problem_response(nothing_to_change(dataset));
    return problem_response(
        {"dataset-fixed",
         "dataset " + dataset.id + " was posted without updates=1: neither its raster nor what a change needs was kept",
         "a dataset that was posted with updates=1", ""});
  }
  return changed(service, request, dataset, route);
}

}  // namespace cordillera::server::updates
