// …/versions and …/rollback; and what a dataset's status says of its changes.
#include <algorithm>
#include <filesystem>

#include "pipeline/store/sqlite.h"
#include "proto/utf8.h"
#include "raster/disk/write_all.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/change_request.h"
#include "server/datasets/ledger.h"
#include "server/fetch/addresses.h"
#include "server/http/conditions.h"
#include "server/http/digest.h"
#include "server/http/percent.h"
#include "server/jobs/source_json.h"
#include "server/jobs/turn.h"
#include "server/log/log.h"
#include "server/options/table_reader.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

Json version_json(const proto::DatasetVersion& version, const proto::Manifest& manifest, bool served) {
  Json json;
  json["number"] = version.number();
  json["version"] = version_of(manifest);
  json["served"] = served;
  json["about"] = version.about();
  json["created"] = version.created();
  json["sources"] = version.sources_size();
  json["tiles"] = manifest.tiles();
  json["triangles"] = manifest.triangles();
  json["bytes"] = manifest.bytes();
  json["href"] = "versions/" + json["version"].get<std::string>() + "/manifest.json";
  return json;
}

/// The number to go back to, out of the query; nullopt: to the one before.
proto::Result<std::optional<std::uint32_t>> wanted(const Request& request) {
  using Number = std::optional<std::uint32_t>;
  static const std::vector<OptionOf<Number>> kOptions = {
      {"to", "", "", "a number of GET …/versions", [](std::string_view text, Number& to) {
         return read_whole(text, {1, UINT32_MAX}, &to.emplace());
       }}};
  Number number;
  if (auto problem = read_options(kOptions, request.query, {.beside = "=NUMBER, or nothing"}, number)) return *problem;
  return number;
}

/// note: with the key of the request, if it has one. changes: what else is remembered of the dataset.
proto::Result<void> go_back(Service& service, const std::string& id, std::optional<std::uint32_t> number, proto::Rollback note,
                            const proto::SourceChanges& changes) {
  const proto::DatasetVersion served = service.ledger().current(id);
  const auto noted = [&](std::uint32_t to) {
    note.set_from(served.number()), note.set_to(to);
    return note.idempotency_key().empty() ? proto::Result<void>() : note_rollback(service.layout().dataset(id), changes, note);
  };
  if (number == served.number()) return noted(*number);
  const auto kept = kept_numbers(service.layout().dataset(id), served);
  const auto found =
      std::find_if(kept.begin(), kept.end(), [&](std::uint32_t one) { return number ? one == *number : one < served.number(); });
  if (found == kept.end()) {
    return Problem{"version-unknown",
                   number ? "version " + std::to_string(*number) + " is not kept" : std::string("no earlier version is kept"),
                   "a number of GET …/versions", "to"};
  }
  const auto version = version_in(kept_store(service.layout().dataset(id), *found));
  if (!version) throw pipeline::StoreError(version.problem().detail);
  if (const auto written = noted(*found); !written) return written;
  const auto back = roll_back(service.layout(), id, *found);
  service.forget(id);
  return back;
}

/// What an earlier request with this key did; nullopt: there was none. A problem: another request had it.
proto::Result<std::optional<proto::Rollback>> earlier_rollback(Ledger& ledger, const std::string& id, const Delivery& delivery,
                                                               const proto::Rollback& now) {
  const proto::SourceChanges changes = ledger.read(id);
  const auto request = request_with(now.idempotency_key(), changes);
  if (request && *request != now.request_hash()) return key_reused(delivery, id, "another request");
  for (const proto::Rollback& rollback : changes.rollbacks())
    if (request && rollback.idempotency_key() == now.idempotency_key()) return std::optional(rollback);
  return std::optional<proto::Rollback>();
}

Problem changing(const Dataset& dataset) {
  return {"dataset-changing", "changes of dataset " + dataset.id + " are pending; going back would be undone by them",
          "asking again when GET …/sources lists none that is pending", ""};
}

/// Why it is not gone back: by now the versions are not as its If-Match has them.
std::optional<Problem> overtaken(Service& service, const Request& request, const Dataset& dataset) {
  if (!request.headers.contains("if-match")) return std::nullopt;
  const Response now = versions(service, request, dataset);
  if (now.status == 404 || if_match_holds(request, now.header("ETag"))) return std::nullopt;
  return condition_failed("If-Match", now.header("ETag"));
}

/// A raster that came behind the first, as the dataset keeps it.
proto::DatasetSource source_behind(const Dataset& dataset, const MoreRaster& raster) {
  proto::DatasetSource source;
  source.set_id(random_letters(8));
  source.set_added(dataset.created);
  source.set_hash(raster.hash);
  source.set_bytes(static_cast<double>(raster.bytes));
  source.mutable_spec()->set_name(raster.name.empty() ? "raster" : raster.name);
  source.mutable_spec()->set_path(raster_path(source.spec().name()));
  source.mutable_spec()->mutable_options()->set_crs(dataset.options.crs());
  return source;
}

}  // namespace

Response versions(Service& service, const Request&, const Dataset& dataset) {
  const Opened opened = open_published(service, dataset, {});
  if (!opened.terrain) return opened.refusal;
  proto::DatasetVersion served = service.ledger().current(dataset.id);
  if (served.number() == 0) {  // of one raster for good
    served.set_number(1);
    served.set_created(dataset.created);
  }
  Json json;
  json["versions"] = Json::array({version_json(served, opened.terrain->manifest(), true)});
  const fs::path folder = service.layout().dataset(dataset.id);
  for (const std::uint32_t number : kept_numbers(folder, served)) {
    const auto version = version_in(kept_store(folder, number));
    if (!version) (void)service.library().damaged(dataset.id, version.problem().detail);  // the others are there
    const auto terrain = service.archive().open(dataset.id, number);
    if (version && *version && terrain && number != served.number())
      json["versions"].push_back(version_json(**version, terrain->manifest(), false));
  }
  return guarded_json(std::move(json));
}

Response rollback(Service& service, const Request& request, const Dataset& dataset) {
  if (auto refused = refuse(request, dataset)) return problem_response(*refused);
  auto number = wanted(request);
  if (!number) return problem_response(number.problem());
  Delivery delivery;
  if (auto wrong = read_headers(request, delivery)) return problem_response(*wrong);
  Token key;
  if (!delivery.key.empty() && !(key = service.key_token(request.who.name, dataset.id + " " + delivery.key)))
    return problem_response(key_in_use(delivery));
  proto::Rollback note;
  note.set_idempotency_key(own_key(request, delivery.key));
  note.set_request_hash(hash_of(request));
  const auto before = earlier_rollback(service.ledger(), dataset.id, delivery, note);
  if (!before) return problem_response(before.problem());
  if (*before) {
    if (service.ledger().current(dataset.id).number() != (*before)->from()) return versions(service, request, dataset);
    *number = (*before)->to();  // the service was killed in between
  }
  auto alone = service.ledger().alone(dataset.id);  // so that of two with one tag the second is told
  if (is_busy(service.ledger(), dataset.id)) return problem_response(changing(dataset));
  // From here on no version is made, and none comes.
  if (auto late = *before ? std::nullopt : overtaken(service, request, dataset)) return problem_response(*late);
  proto::Result<void> done;
  const bool idle = service.ledger().while_idle(
      dataset.id, [&](const proto::SourceChanges& changes) { done = go_back(service, dataset.id, *number, note, changes); });
  alone.unlock();
  if (!idle) return problem_response(changing(dataset));
  if (!done.ok()) return problem_response(done.problem());
  service.ledger().tidy(dataset.id, service.settings().serve.keep_versions);
  service.hub().touch(dataset.id);
  log_info("dataset " + dataset.id + ": version " + std::to_string(service.ledger().current(dataset.id).number()) +
           " is served again");
  return versions(service, request, dataset);
}

bool is_busy(Ledger& ledger, const std::string& id) { return ledger.holds(id) && ledger.first(id).has_value(); }

Json status(Service& service, const std::string& id) try {
  if (!service.ledger().holds(id)) return nullptr;
  const proto::SourceChanges changes = service.ledger().read(id);
  Json json;
  json["version"] = service.ledger().current(id).number();
  json["pending"] = changes.pending_size();
  json["last"] = changes.ended_size() == 0
                     ? Json(nullptr)
                     : change_json(*changes.ended().rbegin(), changes.ended().rbegin()->has_problem() ? "failed" : "done");
  return json;
} catch (const pipeline::StoreError& error) {  // its tiles are served all the same
  (void)service.library().damaged(id, error.what());
  return nullptr;
}

proto::Result<void> begin_dataset(Dataset& dataset, const Delivery& delivery, Upload& upload,
                                  const std::vector<MoreRaster>& more) {
  proto::SourceChange change;
  change.set_id(random_letters(16));
  change.set_kind("add");
  change.set_request_id(dataset.request_id);
  proto::DatasetSource& source = *change.mutable_source();
  source.set_id(random_letters(8));
  source.set_added(dataset.created);
  source.set_url(delivery.address);
  source.set_hash(upload.body_hash());
  source.mutable_spec()->set_name(dataset.name);
  source.mutable_spec()->set_path(raster_path(dataset.name));
  source.mutable_spec()->mutable_options()->set_crs(dataset.options.crs());
  dataset.raster = source.spec().path();
  std::error_code error;
  fs::create_directory(upload.folder() / kSources, error);
  if (!error && delivery.address.empty()) {
    fs::rename(upload.folder() / upload.raster(), upload.folder() / dataset.raster, error);
    if (!error) source.set_bytes(static_cast<double>(fs::file_size(upload.folder() / dataset.raster, error)));
  }
  for (const MoreRaster& raster : more) {
    const proto::DatasetSource& behind = *change.add_more() = source_behind(dataset, raster);
    if (!error) fs::rename(upload.folder() / raster.file, upload.folder() / behind.spec().path(), error);
  }
  if (error || !raster::sync_path(upload.folder() / kSources))
    return Problem{"storage-full", "the raster cannot be put into its place: " + error.message(), "", ""};
  return begin(upload.folder(), std::move(change));
}

std::string name_in(const std::string& address) {
  const std::string path = without_query(address);  // everybody reads the name, and a signature may stand behind ';' too
  const std::string escaped = path.substr(path.rfind('/') + 1), name = percent_decoded(escaped, AddressPart::path);
  if (escaped.empty()) return "raster";
  return proto::is_utf8(name) ? name : escaped;
}

std::string name_of(Service& service, const Delivery& delivery) {
  if (!delivery.address.empty()) return name_in(delivery.address);
  const auto begun = delivery.upload.empty() ? std::nullopt : service.uploads().find(delivery.upload);
  return begun ? begun->name : "";
}

}  // namespace cordillera::server::updates
