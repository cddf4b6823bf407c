#include "server/options/cleap_options.h"

namespace cordillera::server {
namespace {

using namespace gpu::cleap;

constexpr std::uint32_t kMost = 4294967295;

std::vector<std::string> metric_names() {
  std::vector<std::string> names;
  for (const auto& [name, help] : metrics()) names.push_back(name);
  return names;
}
std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// The choice's place among the names is the enumerator's.
template <class T>
Complaint choose(std::string_view text, const std::vector<std::string>& names, T& into) {
  std::string choice;
  if (Complaint complaint = read_choice(text, names, &choice)) return complaint;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (names[k] == choice) into = static_cast<T>(k);
  }
  return {};
}

template <class T>
Complaint whole(std::string_view text, WholeRange range, T& into) {
  std::uint32_t value = 0;
  if (Complaint complaint = read_whole(text, range, &value)) return complaint;
  into = static_cast<T>(value);
  return {};
}

Complaint apply_pool(std::string_view text, CleapRequest& request) {
  if (Complaint complaint = read_number(text, {0, 1}, &request.options.pool)) return complaint;
  if (request.options.pool > 0) return {};
  return "no edge would be tried";
}

std::vector<CleapOption> selection_table() {
  return {
      {"metric", "METRIC", "what an edge costs", joined(metric_names()),
       [](std::string_view text, CleapRequest& request) { return read_choice(text, metric_names(), &request.options.metric); }},
      {"pool", "SHARE", "try this share of the edges, the cheapest", "above 0, up to 1; default 0.8", apply_pool},
      {"selection", "WAY",
       "how they are found: sorted, by a threshold, not at all, as the best at both their ends, or one each of vertices three "
       "edges apart",
       "sort, histogram, unsorted, vertex-best, super-independent",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"sort", "histogram", "unsorted", "vertex-best", "super-independent"}, request.options.selection);
       }},
      {"shuffle", "WAY", "in which order they are tried", "fisher-yates, keyed, none",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"fisher-yates", "keyed", "none"}, request.options.shuffle);
       }},
      {"seed", "S", "of the shuffle", "0 to 4294967295; default 1",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {0, kMost}, request.options.seed);
       }},
      {"passes", "N", "find costs anew when a pool is used up, so often; 1 as published", "1 to 1000; default 100",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {1, 1000}, request.options.most_passes);
       }},
  };
}

std::vector<CleapOption> window_table() {
  return {
      {"window", "N", "candidates at the same time; 0: the whole pool", "0 to 4294967295; default 512",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {0, kMost}, request.options.window);
       }},
      {"lock", "WAY", "who gets triangles that several want: the first in order, or who comes first", "ordered, raced",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"ordered", "raced"}, request.options.lock);
       }},
      {"order", "WAY", "candidates ask for locks before they are tested, or after", "lock-first, test-first",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"lock-first", "test-first"}, request.options.order);
       }},
      {"come-back", "YES", "who lost the lock-down is tried again", "yes, no",
       [](std::string_view text, CleapRequest& request) { return read_switch(text, &request.options.come_back); }},
      {"closing", "YES", "what a collapse touched is left alone for the rest of the pass", "yes, no",
       [](std::string_view text, CleapRequest& request) { return read_switch(text, &request.options.closing); }},
      {"most-triangles", "C", "at a vertex that a collapse makes", "3 to 1000; default 14",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {3, 1000}, request.options.most_triangles);
       }},
      {"inversion", "WAY", "what may not change: the sign of an area in the plan, or a normal, as listed", "sign, normals",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"sign", "normals"}, request.options.inversion);
       }},
      {"border", "WAY", "edges at the border stay, or are collapsed onto it and along it", "keep, collapse",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"keep", "collapse"}, request.options.border);
       }},
      {"repair", "WAY", "the arrays are repaired whole, or around collapses", "everywhere, around",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"everywhere", "around"}, request.options.repair);
       }},
      {"rearrange", "WAY", "gaps are closed in one pass, or one swap after the other; the result is the same", "scan, pointers",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"scan", "pointers"}, request.options.rearrange);
       }},
      {"delaunay", "WHEN", "flip edges until they are Delaunay in the plan", "none, at-end, between",
       [](std::string_view text, CleapRequest& request) {
         return choose(text, {"none", "at-end", "between"}, request.options.delaunay);
       }},
      {"smooth", "STEPS", "of Taubin's smoothing, at the end", "0 to 1000; default 0",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {0, 1000}, request.smooth);
       }},
  };
}

}  // namespace

const std::vector<CleapOption>& cleap_options() {
  static const std::vector<CleapOption> kOptions = [] {
    std::vector<CleapOption> all = selection_table();
    for (CleapOption& option : window_table()) all.push_back(std::move(option));
    return all;
  }();
  return kOptions;
}

proto::Result<CleapRequest> cleap_request(const std::string& strategy, const std::map<std::string, std::string>& given) {
  CleapRequest request;
  Given words;
  for (const auto& [name, value] : given) words.emplace_back("--" + name, value);
  if (auto problem = read_options(cleap_options(), words, {.dashes = "--"}, request)) return *problem;
  if (strategy != "sequential") return request;
  for (const char* name : {"window", "lock", "come-back"}) {
    if (!given.contains(name)) continue;
    return proto::Problem{"options-conflict", std::string("sequential tries one edge after the other: there is no --") + name,
                          "--strategy cleap", std::string("--") + name};
  }
  request.options.window = 1;
  if (!given.contains("repair")) request.options.repair = Repair::around;
  return request;
}

}  // namespace cordillera::server
