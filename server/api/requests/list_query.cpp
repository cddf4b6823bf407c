#include "server/api/requests/list_query.h"

#include <algorithm>
#include <cstdlib>

#include "proto/letters.h"

namespace cordillera::server {
namespace {

constexpr std::uint32_t kMostRows = 1000;  // of a page

Complaint take_limit(std::string_view text, ListQuery& query) { return read_whole(text, {1, kMostRows}, &query.limit); }

Complaint take_after(std::string_view text, ListQuery& query) {
  const bool digits =
      !text.empty() && text.size() <= 19 && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
  const std::uint64_t place = digits ? std::strtoull(std::string(text).c_str(), nullptr, 10) : UINT64_MAX;
  if (place > kLastPlace) return "not the place of a page";
  query.after = static_cast<std::int64_t>(place);
  return std::nullopt;
}

Complaint take_state(std::string_view text, ListQuery& query) {
  query.states.clear();
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(',', from), text.size());
    std::string name;
    if (auto complaint = read_choice(text.substr(from, end - from), {"queued", "running", "ready", "failed"}, &name))
      return complaint;
    for (const State state : {State::queued, State::running, State::ready, State::failed}) {
      if (to_string(state) == name) query.states.push_back(state);
    }
    from = end + 1;
  }
  return std::nullopt;
}

Complaint take_list_box(std::string_view text, ListQuery& query) {
  std::array<double, 4> box{};
  if (auto complaint = read_box(text, &box)) return complaint;
  query.box = box;
  return std::nullopt;
}

Complaint take_search(std::string_view text, ListQuery& query) {
  auto complaint = read_text(text, &query.text);
  query.text = proto::lower(query.text);
  return complaint;
}

}  // namespace

const std::vector<ListOption>& list_options() {
  static const std::vector<ListOption> kOptions = {
      {"limit", "", "most datasets of a page; without it 100", "1 to 1000", take_limit},
      {"after", "", "where the page before ended, as its `next` says", "what a `next` says", take_after},
      {"state", "", "only those in one of these states", "queued, running, ready, failed; more than one separated by commas",
       take_state},
      {"bbox", "", "only those that are ready and touch this box, degrees; west above east crosses the antimeridian",
       "west,south,east,north in degrees, longitudes -180 to 180, latitudes -90 to 90", take_list_box},
      {"q", "", "only those with this text in id, name or title; A to Z like a to z", "text of at most 1000 bytes", take_search},
  };
  return kOptions;
}

proto::Result<ListQuery> list_query(const Given& given) {
  ListQuery query;
  const TableWords words{.of = " of a list", .beside = "; options of a build go with a POST"};
  if (auto problem = read_options(list_options(), given, words, query)) return *problem;
  return query;
}

}  // namespace cordillera::server
