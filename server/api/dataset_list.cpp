#include "server/api/dataset_list.h"

#include <algorithm>
#include <cstdlib>

#include "server/api/api.h"
#include "server/http/json.h"
#include "server/api/public_address.h"
#include "server/datasets/ledger.h"

namespace cordillera::server {
namespace {

constexpr std::uint32_t kMostRows = 1000;       // of a page
constexpr std::size_t kMostLooked = 20000;      // rows that one page looks at: a search of millions is many pages, some of them empty
constexpr std::size_t kPiece = 256;             // rows at a time
constexpr std::int64_t kMounts = kBeforeAll - 1;  // their numbers, from here downwards; no row of a registry comes near

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string in_lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), lower);
  return text;
}

Complaint apply_limit(std::string_view text, ListQuery& query) { return read_whole(text, {1, kMostRows}, &query.limit); }

Complaint apply_after(std::string_view text, ListQuery& query) {
  const bool digits = !text.empty() && text.size() <= 19 && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits) return "not the place of a page";
  query.after = static_cast<std::int64_t>(std::min<std::uint64_t>(std::strtoull(std::string(text).c_str(), nullptr, 10), kBeforeAll));
  return std::nullopt;
}

Complaint apply_state(std::string_view text, ListQuery& query) {
  query.states.clear();
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(',', from), text.size());
    std::string name;
    if (auto complaint = read_choice(text.substr(from, end - from), {"queued", "running", "ready", "failed"}, &name)) return complaint;
    for (const State state : {State::queued, State::running, State::ready, State::failed}) {
      if (to_string(state) == name) query.states.push_back(state);
    }
    from = end + 1;
  }
  return std::nullopt;
}

/// As the builds' own option reads it.
Complaint apply_bbox(std::string_view text, ListQuery& query) {
  const auto& table = build_options();
  const auto option = std::find_if(table.begin(), table.end(), [](const OptionSpec& spec) { return spec.name == "bbox"; });
  Settings settings;
  if (auto complaint = option->apply(text, settings)) return complaint;
  const auto& box = settings.build.bbox();
  query.box = {box[0], box[1], box[2], box[3]};
  return std::nullopt;
}

Complaint apply_text(std::string_view text, ListQuery& query) {
  auto complaint = read_text(text, &query.text);
  query.text = in_lower_case(query.text);
  return complaint;
}

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
  return manifest.bounds(1) <= box[3] && box[1] <= manifest.bounds(3) && meet(manifest.bounds(0), manifest.bounds(2), box[0], box[2]);
}

bool contains(const std::string& text, const std::string& wanted) { return in_lower_case(text).find(wanted) != std::string::npos; }

bool is_wanted(Service& service, const Dataset& dataset, const ListQuery& query) {
  if (!query.states.empty() && std::find(query.states.begin(), query.states.end(), dataset.state) == query.states.end()) return false;
  if (!query.box && query.text.empty()) return true;
  const bool named = query.text.empty() || contains(dataset.id, query.text) || contains(dataset.name, query.text);
  if (named && !query.box) return true;
  if (dataset.state != State::ready) return false;
  const auto summary = service.library().summary(dataset.id);
  if (!summary) return named && !query.box;
  const proto::Manifest& manifest = (*summary)->manifest;
  return (named || contains(manifest.title(), query.text)) && (!query.box || lies_in(manifest, *query.box));
}

std::vector<Row> mounted(Service& service, std::int64_t after) {
  std::vector<Row> rows;
  std::int64_t number = kMounts;
  for (Dataset& dataset : service.mounts().list()) {
    dataset.number = number--;
    if (dataset.number < after) rows.push_back(std::make_shared<const Dataset>(std::move(dataset)));
  }
  return rows;
}

std::string item_text(Service& service, const Request& request, const Row& row) {
  const std::string path = public_path(request, row->id);
  const auto make = [&] { return ListText::item(status_json(service, *row, path)); };
  const bool settled = row->state == State::ready && !service.mounts().has(row->id) && !service.ledger().holds(row->id);
  if (!settled) return make();
  const auto summary = service.library().summary(row->id);
  return summary ? service.list_texts().of({row, *summary, path}, make) : make();
}

/// The same request from there on. folder: the path of the collection.
std::string next_link(const std::string& folder, const Request& request, std::int64_t after) {
  std::string link = folder + "?after=" + std::to_string(after);
  for (const auto& [name, value] : request.query) {
    if (name == "after") continue;
    link.append("&").append(name).append("=");
    for (const char c : value) {
      const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '.' || c == '_' || c == ',';
      static constexpr char kHex[] = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(c);
      plain ? link += c : link.append({'%', kHex[byte >> 4], kHex[byte & 15]});
    }
  }
  return link;
}

}  // namespace

const std::vector<ListOption>& list_options() {
  static const std::vector<ListOption> kOptions = {
      {"limit", "most datasets of a page; without it 100", "1 to 1000", apply_limit},
      {"after", "where the page before ended, as its `next` says", "what a `next` says", apply_after},
      {"state", "only those in one of these states", "queued, running, ready, failed; more than one separated by commas", apply_state},
      {"bbox", "only those that are ready and touch this box, degrees; west above east crosses the antimeridian",
       "west,south,east,north in degrees, longitudes -180 to 180, latitudes -90 to 90", apply_bbox},
      {"q", "only those with this text in id, name or title; A to Z like a to z", "text of at most 1000 bytes", apply_text},
  };
  return kOptions;
}

proto::Result<ListQuery> list_query(const Given& given) {
  ListQuery query;
  std::vector<std::string> names;
  for (const ListOption& option : list_options()) names.push_back(option.name);
  for (auto at = given.begin(); at != given.end(); ++at) {
    const auto& [name, value] = *at;
    const auto option = std::find_if(list_options().begin(), list_options().end(), [&wanted = name](const ListOption& one) { return one.name == wanted; });
    const std::string shown = is_utf8(name) ? name.substr(0, 100) : "(not UTF-8)";
    if (option == list_options().end()) {
      std::string all;
      for (const std::string& known : names) all += (all.empty() ? "" : ", ") + known;
      return proto::Problem{"option-unknown", "unknown query parameter '" + shown + "' of a list", all + "; options of a build go with a POST", shown};
    }
    if (std::any_of(given.begin(), at, [&wanted = name](const auto& earlier) { return earlier.first == wanted; })) {
      return proto::Problem{"option-repeated", name + " is given more than once", option->accepted, name};
    }
    if (const auto wrong = option->apply(value, query)) {
      return proto::Problem{"option-invalid", name + "='" + (is_utf8(value) ? value.substr(0, 100) : "(not UTF-8)") + "': " + *wrong, option->accepted, name};
    }
  }
  return query;
}

Page page_of(Service& service, const Request& request, const ListQuery& query) {
  Page page;
  std::int64_t after = query.after;
  std::size_t looked = 0;
  std::vector<Row> piece = mounted(service, after);
  for (bool first = true; first || !piece.empty(); first = false, piece = service.registry().below(after, kPiece)) {
    for (Row& row : piece) {
      if (looked++ == kMostLooked) {
        page.next = after;
        return page;
      }
      after = row->number;
      if (!may_see(request, *row) || !is_wanted(service, *row, query)) continue;
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
  Response response = json_text_response(200, list.end("next", page.next ? Json(next_link(public_prefix(request) + request.path, request, *page.next)) : Json(nullptr)));
  response.set("Cache-Control", "no-store");
  return response;
}

}  // namespace cordillera::server
