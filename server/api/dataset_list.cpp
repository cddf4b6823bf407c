#include "server/api/dataset_list.h"

#include <algorithm>
#include <array>

#include "proto/letters.h"
#include "server/api/api.h"
#include "server/api/public_address.h"
#include "server/datasets/ledger.h"
#include "server/http/json.h"
#include "server/http/percent.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kMostLooked = 20000;  // rows that one page looks at: a search of millions is many pages, some of them empty
constexpr std::size_t kPiece = 256;         // rows at a time
constexpr std::int64_t kMounts = kLastPlace;  // their numbers, from here downwards; no row of a registry comes near

/// Whether two spans of longitudes have a place in common; west above east crosses the antimeridian.
bool meet(double west, double east, double other_west, double other_east) {
  const auto pieces = [](double from, double to) -> std::vector<std::pair<double, double>> {
    if (from <= to) return {{from, to}};
    return {{from, 180}, {-180, to}};
  };
  for (const auto& [a, b] : pieces(west, east)) {
    for (const auto& [c, d] : pieces(other_west, other_east)) {
      if (a <= d && c <= b) return true;
    }
  }
  return false;
}

bool lies_in(const proto::Manifest& manifest, const std::array<double, 4>& box) {
  if (manifest.bounds_size() < 4) return false;
  return manifest.bounds(1) <= box[3] && box[1] <= manifest.bounds(3) &&
         meet(manifest.bounds(0), manifest.bounds(2), box[0], box[2]);
}

bool contains(const std::string& text, const std::string& wanted) { return proto::lower(text).find(wanted) != std::string::npos; }

bool is_wanted(Library& library, const Dataset& dataset, const ListQuery& query) {
  if (!query.states.empty() && std::find(query.states.begin(), query.states.end(), dataset.state) == query.states.end())
    return false;
  if (!query.box && query.text.empty()) return true;
  const bool named = query.text.empty() || contains(dataset.id, query.text) || contains(dataset.name, query.text);
  if (named && !query.box) return true;
  if (dataset.state != State::ready) return !query.box && contains(dataset.options.title(), query.text);
  const auto summary = library.summary(dataset.id);
  if (!summary) return named && !query.box;
  const proto::Manifest& manifest = (*summary)->manifest;
  return (named || contains(manifest.title(), query.text)) && (!query.box || lies_in(manifest, *query.box));
}

std::vector<Row> mounted(const Mounts& mounts, std::int64_t after) {
  std::vector<Row> rows;
  std::int64_t number = kMounts;
  for (const Row& row : mounts.list()) {
    Dataset dataset = *row;
    dataset.number = number--;
    if (dataset.number < after) rows.push_back(std::make_shared<const Dataset>(std::move(dataset)));
  }
  return rows;
}

std::string item_text(Service& service, const Request& request, const Row& row) {
  const std::string path = public_path(request, row->id);
  const auto make = [&] { return ListText::item(status_json(service, *row, path)); };
  const bool settled = row->state == State::ready && !row->mounted && !service.ledger().holds(row->id);
  if (!settled) return make();
  const auto summary = service.library().summary(row->id);
  return summary ? service.list_texts().of({row, *summary, path}, make) : make();
}

/// The same request from there on. folder: the path of the collection.
std::string next_link(const std::string& folder, const Request& request, std::int64_t after) {
  std::string link = folder + "?after=" + std::to_string(after);
  for (const auto& [name, value] : request.query) {
    if (name == "after") continue;
    link.append("&").append(name).append("=").append(percent_encoded(value, ","));
  }
  return link;
}

}  // namespace

Page page_of(Service& service, const Request& request, const ListQuery& query) {
  Page page;
  std::int64_t after = query.after;
  std::size_t looked = 0;
  std::vector<Row> piece = mounted(service.mounts(), after);
  for (bool first = true; first || !piece.empty(); first = false, piece = service.registry().below(after, kPiece)) {
    for (Row& row : piece) {
      if (looked++ == kMostLooked) {
        page.next = after;
        return page;
      }
      after = row->number;
      if (!may_see(request, *row) || !is_wanted(service.library(), *row, query)) continue;
      if (page.rows.size() == query.limit) {  // only now is it known that there is a next page
        page.next = page.rows.back()->number;
        return page;
      }
      page.rows.push_back(std::move(row));
    }
  }
  return page;
}

Response dataset_list(Service& service, const Request& request) {
  const auto query = list_query(request.query);
  if (!query) return problem_response(query.problem());
  const Page page = page_of(service, request, *query);
  ListText list("datasets");
  for (const Row& row : page.rows) list.add(item_text(service, request, row));
  Response response = json_text_response(
      200,
      list.end("next", page.next ? Json(next_link(public_prefix(request) + request.path, request, *page.next)) : Json(nullptr)));
  response.set("Cache-Control", "no-store");
  return response;
}

}  // namespace cordillera::server
