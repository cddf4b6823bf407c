// /v1/live?url=ADDRESS: a dataset of what stands at an address, without a POST. It is made when it is first asked for, and kept
// as long as there is room.
#include <algorithm>

#include "server/access/audit.h"
#include "server/api/api.h"
#include "server/api/api_updates.h"
#include "server/api/public_address.h"
#include "server/api/requests/prefer.h"
#include "server/fetch/addresses.h"
#include "server/http/digest.h"
#include "server/http/percent.h"
#include "server/log/log.h"
#include "server/options/option_values.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

using proto::Problem;

/// What a query asks for, checked, and what is for the resource itself.
struct LiveQuery {
  std::string address;
  Settings settings;
  Given rest;
  std::string key() const {
    return digest(address + "\n" + to_json_line(settings.build) + (settings.private_dataset ? "private" : ""));
  }
};

/// path: below /v1/live/; a tile or a document takes parameters of its own.
proto::Result<LiveQuery> read_live_query(const Service& service, const Request& request, const std::string& path) {
  static const std::vector<OptionName> kNames = names_in(live_words());
  LiveQuery asked;
  Given options;
  for (const auto& option : request.query) {
    const bool ours = path.empty() || place_of(option.first, kNames, Spelling::query).has_value();
    (ours ? options : asked.rest).push_back(option);
  }
  // Whether anything is fetched from there comes before how it would be built.
  const auto url = std::find_if(options.begin(), options.end(), [](const auto& option) { return option.first == "url"; });
  if (url != options.end()) asked.address = url->second;
  if (asked.address.empty() && !service.settings().serve.source_allow.empty())
    return Problem{"option-invalid", "url, the address of a raster, is missing",
                   "/v1/live?url=ADDRESS with its special characters escaped (curl -G --data-urlencode url=…)", "url"};
  if (const auto allowed = updates::check_address(service.settings().serve, asked.address); !allowed) {
    std::string accepted = "an address that the operator allows";
    if (request.who.role >= access::Role::write) {  // what that is, is not everybody's to know
      for (const std::string& prefix : service.settings().serve.source_allow) accepted += ", below " + prefix;
    }
    return Problem{"option-forbidden", allowed.problem().detail, accepted, "url"};
  }
  LiveWords words{service.settings(), {}};
  if (auto problem = read_layer(live_words(), options, Spelling::query, words, words.settings)) return *problem;
  asked.settings = std::move(words.settings);
  asked.settings.dry_run = false;
  proto::BuildOptions& build = asked.settings.build;
  build.clear_provisional();
  build.set_build(kLazy);
  if (build.keep_size() > 0) build.clear_build();  // these levels are not built block by block
  if (auto refused = asked.settings.private_dataset ? service.gate().refuse_private() : std::nullopt) return *refused;
  if (auto refused = apply_policy(service.settings(), build)) return *refused;
  return asked;
}

/// The row of a dataset that has no raster yet.
proto::Result<Row> make_live(Service& service, const Request& request, const LiveQuery& asked) {
  Dataset dataset;
  const std::string& name = asked.settings.build.name();
  dataset.name = name.empty() ? updates::name_in(asked.address) : name;
  dataset.id = make_id(dataset.name);
  dataset.options = asked.settings.build;
  dataset.created = now_text();
  dataset.raster = "source" + suffix_of(dataset.name);
  dataset.options_hash = asked.key();
  dataset.owner = request.who.name;
  dataset.is_private = asked.settings.private_dataset;
  dataset.request_id = request.id;
  dataset.address = asked.address;
  if (!service.registry().add(dataset)) return Problem{"internal", "the dataset could not be registered", "trying again", ""};
  log_info("dataset " + dataset.id + ": made of " + updates::without_query(asked.address), {{"job", dataset.id}});
  service.audit().note({request.who.name, request.client, request.method, request.path, dataset.id, 0, 202, "", request.id});
  service.queue().enqueue(dataset.id, sender(request));
  return service.registry().find(dataset.id);
}

/// Takes a place among the client's, and if need be the room of a dataset that nobody reads.
proto::Result<Row> make_within_limits(Service& service, const Request& request, const LiveQuery& asked) {
  auto place = service.live().enter(sender(request));
  if (!place && place.problem().type == "datasets-full") {
    const Row oldest = service.live().oldest();
    if (oldest && delete_dataset(service, oldest->id)) place = service.live().enter(sender(request));
  }
  if (!place) return place.problem();
  auto made = make_live(service, request, asked);
  if (made) service.live().hold((*made)->id, std::move(*place));
  return made;
}

/// The dataset, made where there is none and the request may have it made.
proto::Result<Row> live_row(Service& service, const Request& request, const LiveQuery& asked) {
  Row found = service.live().find(asked.key());
  if (found && may_see(request, *found)) return found;
  if (found || !service.settings().serve.live_open || asked.settings.private_dataset) {  // found: what only some may see
    if (auto refused = service.gate().refuse(request, access::Role::write)) {
      if (refused->type == "origin-forbidden") refused->accepted += ", or cordillera serve --live-open";
      return *refused;
    }
    if (found && !may_see(request, *found)) return unknown_to(request, asked.address);
  }
  return service.live().find_or_make(asked.key(), [&] { return make_within_limits(service, request, asked); });
}

std::string rest_of_query(const Given& query) {
  std::string text;
  for (const auto& [name, value] : query)
    text.append(text.empty() ? "?" : "&").append(percent_encoded(name)).append("=").append(percent_encoded(value));
  return text;
}

/// Documents name their tiles by paths beside their own, and some clients count these from where they were led to. What goes on
/// for long, or is made for long, has one address.
bool is_led_to(const Route& route) {
  const pipeline::faces::Resource* resource = route.found.resource;
  return resource != nullptr ? resource->grid == pipeline::faces::Grid::none : route.is(RouteRow::kOneAddress);
}

Response led_to(const std::string& location) {
  Response response;
  response.status = 307;
  response.set("Location", location);
  response.set("Cache-Control", "no-store");
  response.set("Content-Type", "text/plain; charset=utf-8");
  response.body = "It is at " + location + "\n";
  return response;
}

}  // namespace

std::optional<Response> wait_until_read(Service& service, const Request& request, const Dataset& dataset, const Route& route) {
  if (request.waited || (dataset.state != State::queued && dataset.state != State::running)) return std::nullopt;
  if (service.library().provisional(dataset.id)) return std::nullopt;
  auto awaited = awaited_tile(request, route).value_or(Awaited{{}, [](const Dataset&, const pipeline::faces::Terrain* shown) {
                                                                 return shown == nullptr;
                                                               }});
  auto later = wait_for(service, request, dataset, may_wait(service.settings().serve.limits, request), std::move(awaited));
  return later ? std::move(*later) : not_made_yet(service, dataset);
}

namespace {

/// How far the dataset of an address is.
Response live_status(Service& service, const Request& request, const std::string& id) {
  const Row now = service.registry().find(id);
  if (!now) return problem_response(unknown_to(request, id));
  Response response = status_document(service, request, *now);
  response.set("Content-Location", public_path(request, id));
  const bool unfinished = now->state == State::queued || now->state == State::running;
  if (unfinished && !service.library().provisional(id)) response.status = 202;
  return response;
}

/// A wait that ends in vain is answered with how far it is by then.
Response with_status_at_the_end(Response waiting, const std::function<Response()>& status) {
  const auto in_vain = [](const Response& answer) { return answer.problem == "tile-not-ready"; };
  if (!waiting.later) return in_vain(waiting) ? status() : std::move(waiting);
  waiting.later = [later = std::move(waiting.later), status, in_vain](Patience patience) {
    auto answer = later(patience);
    if (answer && in_vain(*answer)) answer = status();
    return answer;
  };
  return waiting;
}

}  // namespace

Live live_dataset(Service& service, const Request& request, const Route& route) {
  auto asked = read_live_query(service, request, route.path);
  if (!asked) return {{}, {}, problem_response(asked.problem())};
  const auto dataset = live_row(service, request, *asked);
  if (!dataset) return {{}, {}, problem_response(dataset.problem())};
  Live live;
  live.request = request;
  const std::string below = route.path.empty() || route.path.starts_with('.') ? route.path : "/" + route.path;
  live.request.path = "/v1/datasets/" + (*dataset)->id + below;
  live.request.query = asked->rest;
  live.route = parse_route(live.request.path);
  if (is_led_to(live.route)) live.answer = led_to(public_path(request, (*dataset)->id) + below + rest_of_query(asked->rest));
  if (!route.path.empty()) return live;
  const bool comes = !request.waited && service.live().note_read(**dataset, sender(request));
  const Row now = service.registry().find((*dataset)->id);  // it may have been woken
  const auto status = [&service, asked = live.request, id = (*dataset)->id] { return live_status(service, asked, id); };
  if (comes && now && preferred_wait(request)) live.answer = wait_until_read(service, request, *now, live.route);
  live.answer = live.answer ? with_status_at_the_end(std::move(*live.answer), status) : status();
  return live;
}

}  // namespace cordillera::server
