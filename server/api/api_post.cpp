// POST /v1/datasets: check, stream to disk, queue, and wait if the client prefers to.
#include <chrono>

#include "server/access/client_address.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/posting.h"
#include "server/api/requests/delivery.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/upload.h"
#include "server/http/digest.h"
#include "server/http/form_body.h"
#include "server/http/json.h"
#include "server/log/log.h"
#include "server/uploads/tus.h"

namespace cordillera::server {
namespace {

proto::Job dry_job(const Posting& posting, const Upload& upload) {
  proto::Job job;
  job.set_id("dry-run");
  job.set_name(posting.name);
  job.set_raster(upload.raster());
  job.set_dry_run(true);
  *job.mutable_options() = posting.settings.build;
  return job;
}

/// Or can be read, where as far as is known nothing more is to be built before somebody reads it.
bool is_built(Service& service, const std::string& id) {
  const auto dataset = service.registry().find(id);
  return !dataset || dataset->state == State::ready || dataset->state == State::failed || is_shown_lazily(service, *dataset);
}

/// The answer to a POST whose dataset exists, as it is now.
Response answer_now(Service& service, const std::string& id, const Posting& posting, const Token& waiting) {
  const auto dataset = service.registry().find(id);
  if (!dataset) return problem_response(unknown_dataset(id));
  const bool failed = posting.delivery.wait.count() > 0 && dataset->state == State::failed && dataset->problem;
  Response response =
      failed ? problem_response(*dataset->problem)
             : json_response(dataset->state == State::ready ? 201 : 202, status_json(service, *dataset, posting.folder + id));
  response.set("Location", posting.folder + id);
  if (waiting) response.set("Preference-Applied", "wait=" + std::to_string(posting.delivery.wait.count()));
  return response;
}

/// The same, at once or after the wait that the client prefers.
Response accepted(Service& service, const std::string& id, const Posting& posting) {
  const Token waiting = posting.delivery.wait.count() > 0 ? service.wait_token() : nullptr;
  if (!waiting) return answer_now(service, id, posting, nullptr);
  Response response;
  response.later = [&service, id, posting, waiting, end = std::chrono::steady_clock::now() + posting.delivery.wait](
                       Patience patience) -> std::optional<Response> {
    if (patience == Patience::more && !service.stopping() && std::chrono::steady_clock::now() < end && !is_built(service, id))
      return std::nullopt;
    return answer_now(service, id, posting, waiting);
  };
  return response;
}

/// Adds the row, or removes the raster again: a disk that is full must not stay so for an upload that was refused.
bool registered(Service& service, const Dataset& dataset) {
  try {
    return service.registry().add(dataset);
  } catch (const RegistryInDoubt&) {
    throw;  // a row that is there all the same, in a log that could not be synced, keeps its raster
  } catch (const RegistryError&) {
    remove_dataset_folder(service.layout(), dataset.id);
    throw;
  }
}

/// What a posting is made of, on disk by now.
struct Rasters {
  Upload& first;
  const std::vector<MoreRaster>& more;
  std::string hash;
};

Response create(Service& service, const Posting& posting, const Rasters& rasters, const Request& request, limits::Slot slot) {
  Upload& upload = rasters.first;
  Dataset dataset;
  dataset.id = posting.id.empty() ? make_id(posting.name) : posting.id;
  dataset.name = posting.name;
  dataset.options = posting.settings.build;
  dataset.created = now_text();
  dataset.raster = upload.raster();
  dataset.idempotency_key = posting.delivery.key;
  dataset.options_hash = posting.options_hash;
  dataset.body_hash = rasters.hash;
  dataset.owner = request.who.name;
  dataset.is_private = posting.settings.private_dataset;
  dataset.request_id = request.id;
  if (posting.again) dataset.address = posting.delivery.address;
  const auto place = service.layout().dataset(dataset.id);
  if (posting.updates) {
    const auto begun = updates::begin_dataset(dataset, posting.delivery, upload, rasters.more);
    if (!begun) return problem_response(begun.problem());
  }
  if (const auto written = write_record(upload.folder(), dataset); !written) return problem_response(written.problem());
  if (const auto kept = upload.move_to(place); !kept) return problem_response(kept.problem());
  if (!registered(service, dataset)) {
    remove_dataset_folder(service.layout(), dataset.id);
    return problem_response({"internal", "the dataset could not be registered", "trying again", ""});
  }
  log_info("dataset " + dataset.id + ": queued", {{"job", dataset.id}});
  service.queue().enqueue(dataset.id, sender(request));
  slot.reset();  // the dataset counts for itself now
  if (!posting.delivery.upload.empty()) service.uploads().remove(posting.delivery.upload);
  return accepted(service, dataset.id, posting);
}

/// Rasters that came before all of their options were known.
struct Come {
  Upload& raster;
  std::vector<MoreRaster> more;
  limits::Slot place;
  std::string hash;  ///< of all of them
};

Response post(Service& service, const Request& request, Come* come, const std::string& id = "") {
  auto posting = read_posting(service, request, come != nullptr ? RasterIs::optional : RasterIs::needed);
  if (!posting) return problem_response(posting.problem());
  posting->id = id;
  if (come != nullptr && posting->delivery.any()) {
    return problem_response(
        {"options-conflict", "the form has a file, and a field that names another raster", "one of them", "file"});
  }
  const std::vector<MoreRaster> more = come != nullptr ? come->more : std::vector<MoreRaster>();
  if (!more.empty()) {
    if (auto refused = take_several(request, *posting)) return problem_response(*refused);
  }
  Token key;
  Row earlier;
  if (!posting->delivery.key.empty()) {
    key = service.key_token(request.who.name, posting->delivery.key);
    if (!key) return problem_response(key_in_use(posting->delivery));
    earlier = service.registry().find_by_key(request.who.name, posting->delivery.key);
    if (earlier && earlier->options_hash != posting->options_hash)
      return problem_response(key_reused(posting->delivery, earlier->id, "other options"));
  }
  auto place = come != nullptr ? proto::Result<limits::Slot>(std::move(come->place))
                               : service.admission().enter(sender(request), posting->delivery.expected,
                                                           earlier ? limits::Entry::again : limits::Entry::fresh);
  if (!place) return problem_response(place.problem());
  std::optional<Upload> own;
  Upload& upload = come != nullptr ? come->raster : own.emplace(service.layout(), suffix_of(posting->name));
  if (earlier && !posting->delivery.upload.empty() && !service.uploads().find(posting->delivery.upload)) {
    place->reset();
    key.reset();
    return accepted(service, earlier->id, *posting);  // made of this very upload
  }
  if (const auto taken = take_raster(service, posting->delivery, request, upload); !taken)
    return problem_response(taken.problem());
  const std::string hash = come != nullptr ? come->hash : posting->again ? digest(posting->delivery.address) : upload.body_hash();
  if (earlier && earlier->body_hash != hash)
    return problem_response(key_reused(posting->delivery, earlier->id, "another raster"));
  if (posting->settings.dry_run) return dry_run(service.queue(), request, dry_job(*posting, upload), upload.folder());
  if (!earlier) return create(service, *posting, {upload, more, hash}, request, std::move(*place));
  place->reset();
  key.reset();
  return accepted(service, earlier->id, *posting);
}

/// The files of a form on their way to disk.
struct FormFiles {
  Upload& first;
  MoreRasters more;
  std::uint64_t came = 0;  ///< bytes of the body so far
};

/// Whether one field says where the raster is: then the form needs no file.
bool names_raster(const FormReader& form) { return is_given(form.fields(), "source") || is_given(form.fields(), "upload"); }

/// Problems: of the form, of the disk, and of a body that is too large.
proto::Result<void> receive_files(Service& service, const Request& request, FormReader& form, FormFiles& files) {
  const std::uint64_t most = most_bytes(service.settings().serve.limits);
  std::string full;
  const auto claim = service.admission().space().claim(0, &full);
  if (!claim) return limits::storage_full(full);
  const Request counted = watched(request, *claim, &full);
  Request first = request;
  std::size_t begun = 1;
  bool written = true;
  first.read_body = [&](const Request::Sink& sink) {
    const auto take = [&](std::string_view bytes) {
      if (form.file_names().size() == 1) return sink(bytes);
      while (written && begun < form.file_names().size()) written = files.more.begin(form.file_names()[begun++]);
      return written = written && files.more.add(bytes);
    };
    const bool whole =
        counted.read_body([&](std::string_view piece) { return (files.came += piece.size()) <= most && form.feed(piece, take); });
    while (written && begun < form.file_names().size())
      written = files.more.begin(form.file_names()[begun++]);  // the last ones may be empty
    return whole && form.ended();
  };
  const auto received = files.first.receive(first, most, std::nullopt);
  if (form.problem()) return *form.problem();
  if (form.ended() && form.file_names().empty() && names_raster(form)) return {};
  if (form.ended() && form.file_names().empty())
    return proto::Problem{"form-invalid", "the form has no file", "curl -F file=@dem.tif, with the sign before the name", "file"};
  if (files.came > most)
    return proto::Problem{"body-too-large", "the form is larger than this service takes",
                          "at most " + std::to_string(most >> 20) + " MiB", ""};
  if (!full.empty()) return limits::storage_full(full);
  if (!written) return files.more.finish().problem();
  return received;
}

/// Its files are written down while they come, with a place as any other; its fields are options as if they stood in the query.
Response post_form(Service& service, const Request& request, FormReader form) {
  const std::string announced = request.header("content-length").value_or("");
  const auto bytes = announced.empty() ? std::nullopt : announced_bytes(announced);
  auto place = service.admission().enter(sender(request), bytes, limits::Entry::fresh);
  if (!place) return problem_response(place.problem());
  Upload upload(service.layout(), "");
  FormFiles files{upload, MoreRasters(upload.folder())};
  if (const auto received = receive_files(service, request, form, files); !received) {
    const bool empty = received.problem().type == "body-empty" && !form.file_names().empty();
    return problem_response(empty ? proto::Problem{"body-empty", "the file of the form is empty", "curl -F file=@dem.tif", "file"}
                                  : received.problem());
  }
  auto behind = files.more.finish();
  if (!behind) return problem_response(behind.problem());
  if (auto unknown = unknown_in_body(form.fields(), "field")) return problem_response(*unknown);
  Request plain = request;
  for (const auto& field : form.fields())
    if (!field.second.empty()) plain.query.push_back(field);  // a page sends those that were left blank, too
  forget_body_headers(plain);
  if (form.file_names().empty()) {
    plain.read_body = nullptr;
    place->reset();  // it asks for one of its own, as a POST whose query names the raster
    return post(service, plain, nullptr);
  }
  std::error_code unknown_size;
  behind->insert(behind->begin(), {form.file_names().front(), upload.raster(), upload.body_hash(),
                                   std::filesystem::file_size(upload.folder() / upload.raster(), unknown_size)});
  auto more = with_sides_packed(upload.folder(), *behind);
  if (!more) return problem_response(more.problem());
  // The form's bytes are those of each, for nobody knows which they were.
  if (request.sent)
    for (const MoreRaster& raster : *more) note_sent(upload.folder() / raster.file, *request.sent);
  upload.take(more->front().file, more->front().hash);
  std::string name = more->front().name;
  more->erase(more->begin());
  for (const auto& [key, value] : plain.query) {
    if (key == "name") name = value;
  }
  if (!name.empty() && !is_given(plain.query, "name")) plain.query.emplace_back("name", name);
  if (const auto renamed = upload.rename(suffix_of(name)); !renamed) return problem_response(renamed.problem());
  std::string hash = upload.body_hash();
  for (const MoreRaster& raster : *more) hash = digest(hash + raster.hash);
  Come come{upload, std::move(*more), std::move(*place), hash};
  return post(service, plain, &come);
}

}  // namespace

std::string sender(const Request& request) {
  return request.who.name.empty() ? access::share_of(request.client) : "token " + request.who.name;
}

Response post_dataset(Service& service, const Request& request, const std::string& id) {
  const std::string type = request.header("content-type").value_or("");
  if (auto form = FormReader::of(type)) return post_form(service, request, std::move(*form));
  const bool json = type.starts_with("application/json");
  if (!json && !type.starts_with("application/x-www-form-urlencoded")) return post(service, request, nullptr, id);
  const auto plain = json ? with_json_as_query(request) : with_typed_body_as_query(request);
  if (!plain) return problem_response(plain.problem());
  if (plain->read_body) {  // a raster after all
    const auto stripped = std::make_shared<bool>(false);
    Response response = post(service, with_body_looked_at(*plain, stripped), nullptr, id);
    return *stripped ? problem_response(body_stripped()) : response;
  }
  const Given told(plain->query.begin() + static_cast<std::ptrdiff_t>(request.query.size()), plain->query.end());
  if (auto unknown = unknown_in_body(told, json ? "member" : "field")) return problem_response(*unknown);
  return post(service, *plain, nullptr);
}

}  // namespace cordillera::server
