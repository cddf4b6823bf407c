#include "server/api/api_stac.h"

#include "pipeline/faces/web_mercator.h"
#include "server/api/api.h"
#include "server/api/dataset_list.h"
#include "server/api/public_address.h"
#include "server/stac/documents.h"

namespace cordillera::server::stac {
namespace {

constexpr std::uint32_t kMostItems = 100;  // of a page: an item is some kilobytes

/// The service's own folder: public_folder is that of the request's path.
ServiceRoot place_of(const Request& request) {
  Request at_root = request;
  at_root.path = "/";
  std::string folder = public_folder(at_root);
  if (folder.empty()) return {public_prefix(request)};
  folder.pop_back();
  return {std::move(folder)};
}

Response document(const Json& json, const char* type = "application/json") {
  Response response = json_response(200, json);
  for (auto& [name, value] : response.headers) {
    if (name == "Content-Type") value = type;
  }
  response.set("Cache-Control", "no-store");
  response.set("Vary", kAddressHeaders);
  return response;
}

/// limit, after and bbox of a list of datasets; the rest of its parameters mean nothing here.
proto::Result<ListQuery> query_of(const Request& request) {
  static const std::vector<ListOption> kOptions = [] {
    std::vector<ListOption> options = list_options();
    std::erase_if(options, [](const ListOption& option) { return option.name == "state" || option.name == "q"; });
    return options;
  }();
  ListQuery query;
  if (auto problem = read_options(kOptions, request.query, {.of = " of a list of items"}, query)) return *problem;
  query.limit = std::min(query.limit, kMostItems);
  query.states = {State::ready};
  return query;
}

Json item_of(const Mounts& mounts, const ServiceRoot& place, const Dataset& dataset, const proto::Manifest& manifest) {
  Offered offered{{}, mounts.folder(dataset.id).empty() && pipeline::faces::extent_of(manifest)};
  for (const Part& part : parts_of(mounts, dataset.id, manifest)) offered.faces.push_back(part.face);
  return item(place, dataset, manifest, offered);
}

}  // namespace

Response items(Service& service, const Request& request) {
  const auto query = query_of(request);
  if (!query) return problem_response(query.problem());
  const ServiceRoot place = place_of(request);
  const Page page = page_of(service, request, *query);
  std::vector<Json> features;
  for (const Row& row : page.rows) {
    const auto summary = service.library().summary(row->id);
    if (summary) features.push_back(item_of(service.mounts(), place, *row, (*summary)->manifest));
  }
  std::string self, next = page.next ? "after=" + std::to_string(*page.next) : "";
  for (const auto& [name, value] : request.query) {  // numbers and commas: they were read
    self += (self.empty() ? "" : "&") + name + "=" + value;
    if (page.next && name != "after") next += "&" + name + "=" + value;
  }
  return document(item_list(place, features, self, next), "application/geo+json");
}

Response one_item(Service& service, const Request& request, const Route& route) {
  const Row dataset = service.find(route.id);
  if (!dataset || !may_see(request, *dataset)) return problem_response(unknown_to(request, route.id));
  if (dataset->state != State::ready) return open_published(service, *dataset, {}).refusal;
  const auto summary = service.library().summary(route.id);
  if (!summary) return problem_response(summary.problem());
  return document(item_of(service.mounts(), place_of(request), *dataset, (*summary)->manifest), "application/geo+json");
}

Response landing(const Request& request) { return document(landing_page(place_of(request))); }
Response conforms() { return document(conformance()); }
Response all_collections(const Request& request) { return document(collections(place_of(request))); }
Response one_collection(const Request& request) { return document(collection(place_of(request))); }

}  // namespace cordillera::server::stac
