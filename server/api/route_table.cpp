// The table: a resource is answered, described and counted because it stands here. A new one is a row and its handler.
#include "pipeline/store/sqlite.h"
#include "proto/numbers.h"
#include "server/api/api.h"
#include "server/api/api_stac.h"
#include "server/api/api_updates.h"
#include "server/api/dataset_list.h"
#include "server/api/documents/browser_pages.h"
#include "server/api/documents/openapi.h"
#include "server/api/documents/web.h"
#include "server/api/requests/delivery.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

// Handlers take no more than they need.
Handler by(Response (*make)()) {
  return [make](Service&, const Request&, const Route&) { return make(); };
}
Handler by(Response (*make)(Service&)) {
  return [make](Service& service, const Request&, const Route&) { return make(service); };
}
Handler by(Response (*make)(const Request&)) {
  return [make](Service&, const Request& request, const Route&) { return make(request); };
}
Handler by(Response (*make)(Service&, const Request&)) {
  return [make](Service& service, const Request& request, const Route&) { return make(service, request); };
}

using OfRow = Response (*)(Service&, const Request&, const Dataset&);
using OfDataset = std::function<Response(Service&, const Request&, const Dataset&, const Route&)>;

/// What is asked of a dataset's row: none of its files is looked at.
Handler of_row(OfRow make) {
  return [make](Service& service, const Request& request, const Route& route) {
    const Row dataset = service.find(route.id);
    return dataset && may_see(request, *dataset) ? make(service, request, *dataset)
                                                 : problem_response(unknown_to(request, route.id));
  };
}

/// Of answers that are hardly ever asked for twice. Nothing of a dataset stays in the front when the dataset has gone.
std::shared_ptr<const std::string> made_anew(const std::string&, const std::function<std::string()>& make) {
  return std::make_shared<const std::string>(make());
}

/// What every answer of a dataset has, whatever it is of.
Response in_dataset(Service& service, const Request& request, const Route& route, const OfDataset& make) {
  const std::uint64_t state = service.library().changes();  // before anything is looked at
  const Row dataset = service.find(route.id);
  // One answer for both, and one way to it: else anybody could find out which private ids there are.
  if (!dataset || !may_see(request, *dataset)) return problem_response(unknown_to(request, route.id));
  // Of what is there now; who looks at a dataset's state does not read it.
  const bool reads_terrain = route.is(RouteRow::kTerrain) && route.version.empty();
  if (reads_terrain && !request.waited && service.live().note_read(*dataset, sender(request))) {
    const Row now = service.find(route.id);  // it may have been woken
    if (auto later = now ? wait_until_read(service, request, *now, route) : std::nullopt) return *later;
  }
  const auto read = [&] { return make(service, request, *dataset, route); };
  Response response;
  try {
    response = dataset->mounted ? of_mount(service.mounts(), dataset->id, read) : read();
  } catch (const pipeline::NoDescriptor&) {
    response = problem_response(wants_descriptor(dataset->id));
  } catch (const pipeline::StoreError& error) {
    response = problem_response(service.library().damaged(dataset->id, error.what()));
  }
  if (dataset->is_private) keep_from_others(response);
  if (!response.keep) response.keep = made_anew;
  const bool plain = dataset->state == State::ready && dataset->address.empty() && !dataset->is_private && !dataset->mounted &&
                     route.version.empty() && !logs_debug();
  if (plain && route.found.resource != nullptr && route.found.resource->tag != nullptr && response.shared) {
    response.same_while = state;
    response.counts = std::make_shared<const metrics::KeptCounts>(service.metrics().kept_counts(route_name(route)));
  }
  return response;
}

Handler of_dataset(OfDataset make) {
  return [make = std::move(make)](Service& service, const Request& request, const Route& route) {
    return in_dataset(service, request, route, make);
  };
}
Handler of_dataset(OfRow make) {
  return of_dataset([make](Service& service, const Request& request, const Dataset& dataset, const Route&) {
    return make(service, request, dataset);
  });
}

Response posted(Service& service, const Request& request) { return post_dataset(service, request); }

/// Room for all of it must be there now: a client that is told "no" after 40 GB has wasted a day.
Response begin_upload(Service& service, const Request& request) {
  const auto bytes = announced_bytes(request.header("upload-length").value_or(""));
  const uploads::Bounds bounds = upload_bounds(service.settings().serve.limits, request);
  const bool fits = bytes && *bytes <= bounds.most_bytes;  // else begin() says why
  const std::string full = fits ? service.admission().space().full(*bytes) : "";
  if (!full.empty()) return problem_response(limits::storage_full(full));
  return uploads::begin(service.uploads(), request, bounds);
}

Response at_upload(Service& service, const Request& request, const Route& route) {
  return uploads::at(service.uploads(), route.id, request);
}

/// A part takes a thread and the disk's time, as a whole raster does, so it needs a place too.
Response take_part(Service& service, const Request& request, const Route& route) {
  const std::uint64_t bytes = announced_bytes(request.header("content-length").value_or("")).value_or(0);
  const auto place = service.admission().enter(sender(request), bytes, limits::Entry::part);
  if (!place) return problem_response(place.problem());
  std::string full;
  const auto claim = service.admission().space().claim(bytes, &full);
  Response response = claim ? uploads::at(service.uploads(), route.id, watched(request, *claim, &full)) : Response();
  return full.empty() ? response : problem_response(limits::storage_full(full));
}

Response viewer(Service& service, const Request& request) {
  return page(service.web_files(), service.settings().serve.web, request,
              [&] { return page_of(service, request, {}).rows; });  // the newest
}

Response demo(Service& service, const Request&, const Route& route) {
  return demo_page(service.web_files(), service.settings().serve.web, route.path);
}

Response api_document(Service& service) {
  return api_description(service.gate().has_tokens() ? Tokens::asked_for : Tokens::none);
}

/// A row. Written in braces, each of its fields would be formatted into a line of its own.
RouteRow table_row(std::string_view path, std::string_view name, std::string_view tag, unsigned is,
                   std::vector<RouteMethod> methods) {
  return {path, name, tag, is, std::move(methods)};
}

/// The answer of the dataset that the address names.
Response of_address(Service& service, const Request& request, const Route& route) {
  const Live live = live_dataset(service, request, route);
  return live.answer ? *live.answer : live.route.row->method(live.request.method)->handler(service, live.request, live.route);
}

}  // namespace

std::optional<std::uint64_t> announced_bytes(const std::string& length) { return proto::number<std::uint64_t>(length); }

uploads::Bounds upload_bounds(const Limits& limits, const Request& request) { return {most_bytes(limits), sender(request)}; }

const std::vector<RouteRow>& route_table() {
  using enum RouteRow::Is;
  using enum access::Role;
  static const std::vector<RouteRow> kTable = {
      table_row("/v1", "index", "service", kTried, {{"GET", none, "index", by(index)}}),
      table_row("/v1/limits", "limits", "service", kPlain, {{"GET", none, "limits", by(limits_in_effect)}}),
      table_row("/v1/live", "live", "live", kPlain, {{"GET", none, "live", of_address}}),
      table_row("/v1/uploads", "uploads", "uploads", kTus, {{"POST", write, "begin_upload", by(begin_upload)}}),
      table_row("/v1/uploads/{id}", "upload", "uploads", kTus,
                {{"GET", none, "upload", at_upload},
                 {"PATCH", write, "continue_upload", take_part},
                 {"DELETE", write, "end_upload", at_upload}}),
      table_row("/v1/datasets", "datasets", "datasets", kPlain,
                {{"GET", none, "list_datasets", by(dataset_list)},
                 {"POST", write, "post_dataset", by(posted)},
                 {"PUT", write, "put_dataset", by(posted)}}),
      table_row("/v1/datasets/{id}", "dataset", "datasets", kPlain,
                {{"GET", none, "dataset", of_row(status_document)},
                 {"PATCH", write, "describe_dataset", of_row(describe_dataset)},
                 {"DELETE", write, "delete_dataset", of_row(remove_dataset)}}),
      table_row("/v1/datasets/{id}.pmtiles", "archive", "tiles", kLive | kTerrain | kOneAddress,
                {{"GET", none, "archive", of_dataset(archive)}}),
      table_row("/v1/datasets/{id}/events", "events", "datasets", kLive | kOneAddress | kQuick,
                {{"GET", none, "events", of_dataset(event_stream)}}),
      table_row("/v1/datasets/{id}/manifest.json", "manifest", "datasets", kVersioned | kLive | kTerrain | kOneAddress,
                {{"GET", none, "manifest", of_dataset(published)}}),
      table_row("/v1/datasets/{id}/elevation", "elevation", "heights", kVersioned | kLive | kTerrain,
                {{"GET", none, "elevation", of_dataset(elevation)}, {"POST", none, "elevation_by_post", of_dataset(elevation)}}),
      table_row("/v1/datasets/{id}/mesh.{mesh_format}", "mesh", "meshes", kVersioned | kLive | kTerrain | kOneAddress | kLarge,
                {{"GET", none, "mesh", of_dataset(extracted_mesh)}}),
      table_row(
          "/v1/datasets/{id}/sources", "sources", "sources", kPlain,
          {{"GET", none, "sources", of_dataset(updates::sources)}, {"POST", write, "add_source", of_dataset(updates::sources)}}),
      table_row("/v1/datasets/{id}/sources/{source}", "source", "sources", kPlain,
                {{"GET", none, "source", of_dataset(updates::sources)},
                 {"PUT", write, "replace_source", of_dataset(updates::sources)},
                 {"DELETE", write, "remove_source", of_dataset(updates::sources)}}),
      table_row("/v1/datasets/{id}/versions", "versions", "versions", kPlain,
                {{"GET", none, "versions", of_dataset(updates::versions)}}),
      table_row("/v1/datasets/{id}/rollback", "rollback", "versions", kPlain,
                {{"POST", write, "rollback", of_dataset(updates::rollback)}}),
      table_row("/v1/datasets/{id}/demo/{client}.html", "demo", "datasets", kPlain, {{"GET", none, "demo", demo}}),
      table_row("/v1/datasets/{id}/{resource}", "face", "tiles", kVersioned | kLive | kTerrain,
                {{"GET", none, "resource", of_dataset(published)}}),
      table_row("/stac", "stac", "stac", kPlain, {{"GET", none, "stac", by(stac::landing)}}),
      table_row("/stac/conformance", "stac", "stac", kPlain, {{"GET", none, "stac_conformance", by(stac::conforms)}}),
      table_row("/stac/collections", "stac", "stac", kPlain, {{"GET", none, "stac_collections", by(stac::all_collections)}}),
      table_row("/stac/collections/datasets", "stac", "stac", kPlain,
                {{"GET", none, "stac_collection", by(stac::one_collection)}}),
      table_row("/stac/collections/datasets/items", "stac", "stac", kPlain, {{"GET", none, "stac_items", by(stac::items)}}),
      table_row("/stac/collections/datasets/items/{id}", "stac", "stac", kPlain, {{"GET", none, "stac_item", stac::one_item}}),
      table_row("/api", "api", "service", kPlain, {{"GET", none, "description", by(api_document)}}),
      table_row("/openapi.json", "api", "service", kPlain, {{"GET", none, "openapi", by(api_document)}}),
      table_row("/healthz", "healthz", "service", kQuick, {{"GET", none, "health", by(alive)}}),
      table_row("/readyz", "readyz", "service", kQuick, {{"GET", none, "readiness", by(readiness)}}),
      table_row("/metrics", "metrics", "service", kPlain, {{"GET", read, "metrics", by(metrics_text)}}),
      table_row("/docs", "viewer", "service", kTried, {{"GET", none, "docs", by(docs_page)}}),
      table_row("/version", "viewer", "service", kTried, {{"GET", none, "version", by(version_document)}}),
      table_row("/favicon.ico", "viewer", "service", kTried, {{"GET", none, "icon", by(icon)}}),
      table_row("/", "viewer", "service", kTried | kElsewhere, {{"GET", none, "viewer", by(viewer)}}),
  };
  return kTable;
}

}  // namespace cordillera::server
