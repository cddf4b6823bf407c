#include "server/api/change_request.h"

#include <algorithm>

#include "server/api/api_updates.h"
#include "server/datasets/ledger.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/log/log.h"
#include "server/options/request_policy.h"

namespace cordillera::server::updates {
namespace {

using proto::Problem;

/// The raster's name and options: those that it had, with those of the request over them.
std::optional<Problem> take_options(Service& service, proto::BuildOptions options, const proto::DatasetSource* old,
                                    const Delivery& delivery, proto::SourceSpec& spec) {
  const Settings& server = service.settings();
  spec.set_name(options.name());
  options.clear_name();
  proto::BuildOptions checked = options;
  checked.set_water_mask(server.build.water_mask());  // not this raster's to ask for
  if (auto refused = apply_policy(server, checked)) return refused;
  if (spec.name().empty()) spec.set_name(name_of(service, delivery));
  if (spec.name().empty() && old != nullptr) spec.set_name(old->spec().name());
  if (spec.name().empty()) spec.set_name("raster");
  *spec.mutable_options() = options;
  return std::nullopt;
}

const proto::DatasetSource* find(const std::vector<proto::DatasetSource>& sources, const std::string& id) {
  const auto found =
      std::find_if(sources.begin(), sources.end(), [&](const proto::DatasetSource& source) { return source.id() == id; });
  return found == sources.end() ? nullptr : &*found;
}

}  // namespace

std::string hash_of(const Request& request) {
  std::string text = request.method + " " + request.path;
  for (const auto& [name, value] : request.query) text.append(1, '\n').append(name).append(1, '=').append(value);
  return digest(text);
}

std::string own_key(const Request& request, const std::string& key) {
  // No header holds the character between them.
  return key.empty() || request.who.name.empty() ? key : request.who.name + '\x1f' + key;
}

std::string raster_path(const std::string& name) { return std::string(kSources) + "/" + random_letters(12) + suffix_of(name); }

proto::Result<ChangeRequest> read_change(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  const Settings& server = service.settings();
  const std::vector<proto::DatasetSource> sources = service.ledger().expected(dataset.id);
  ChangeRequest asked;
  proto::SourceChange& change = asked.change;
  proto::DatasetSource& source = *change.mutable_source();
  change.set_id(random_letters(16));
  change.set_kind(request.method == "POST" ? "add" : request.method == "PUT" ? "replace" : "remove");
  change.set_request_id(request.id);
  change.set_request_hash(hash_of(request));
  const proto::DatasetSource* old = nullptr;
  if (const std::string& id = route.item; !id.empty()) {
    old = find(sources, id);
    asked.known = old != nullptr;
    source.set_id(id);
  } else {
    source.set_id(random_letters(8));
  }
  if (request.method == "DELETE") {
    if (!request.query.empty())
      return unknown_option(request.query.front().first, {}, {.what = "a DELETE has no parameter", .accepted = "none"});
    if (auto refused = check_delivery(server.serve, request, RasterIs::optional, asked.delivery)) return *refused;
    if (asked.delivery.any()) return Problem{"request-invalid", "a DELETE has no raster", "no body", ""};
    change.set_idempotency_key(own_key(request, asked.delivery.key));
    return asked;
  }
  if (auto refused = check_raster_layer(request.query)) return *refused;
  ChangeWords words;
  if (old != nullptr) words.settings.build = old->spec().options();
  if (auto problem = read_layer(change_words(), request.query, Spelling::query, words, words.settings)) return *problem;
  static_cast<RasterWords&>(asked.delivery) = words.raster;
  if (words.position) change.set_position(*words.position);
  if (auto refused = take_options(service, words.settings.build, old, asked.delivery, *source.mutable_spec())) return *refused;
  const RasterIs raster = request.method == "POST" ? RasterIs::needed : RasterIs::optional;
  if (auto refused = check_delivery(server.serve, request, raster, asked.delivery)) return *refused;
  asked.delivery.key_by_upload();
  change.set_idempotency_key(own_key(request, asked.delivery.key));
  if (!asked.delivery.any() && request.query.empty())  // a version that is as the one before would take the place of a kept one
    return Problem{"option-invalid", "nothing is to change", "a raster as the body, source=, upload=, position or options", ""};
  if (!asked.delivery.any()) return asked;
  source.mutable_spec()->set_path(raster_path(source.spec().name()));
  source.set_added(now_text());
  source.set_url(asked.delivery.address);
  return asked;
}

}  // namespace cordillera::server::updates
