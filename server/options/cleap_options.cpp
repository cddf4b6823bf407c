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

/// A row with names to choose from. A name's place among them is the enumerator's.
template <class T>
CleapOption choice(const char* name, const char* help, std::vector<std::string> names, T Options::*into,
                   const char* value = "WAY") {
  const auto apply = [names, into](std::string_view text, CleapRequest& request) -> Complaint {
    std::string chosen;
    if (Complaint complaint = read_choice(text, names, &chosen)) return complaint;
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (names[k] == chosen) request.options.*into = static_cast<T>(k);
    }
    return {};
  };
  return {name, value, help, joined(names), apply};
}

template <class T>
Complaint whole(std::string_view text, WholeRange range, T& into) {
  std::uint32_t value = 0;
  if (Complaint complaint = read_whole(text, range, &value)) return complaint;
  into = static_cast<T>(value);
  return {};
}

/// A row for a whole number. value: what stands for it in help.
template <class T>
CleapOption number(const char* name, const char* value, const char* help, WholeRange range, const char* accepted,
                   T Options::*into) {
  return {name, value, help, accepted,
          [range, into](std::string_view text, CleapRequest& request) { return whole(text, range, request.options.*into); }};
}

CleapOption yes_or_no(const char* name, const char* help, bool Options::*into) {
  return {name, "YES", help, "yes, no",
          [into](std::string_view text, CleapRequest& request) { return read_switch(text, &(request.options.*into)); }};
}

Complaint apply_pool(std::string_view text, CleapRequest& request) {
  if (Complaint complaint = read_number(text, {0, 1}, &request.options.pool)) return complaint;
  if (request.options.pool > 0) return {};
  return "no edge would be tried";
}

}  // namespace

const std::vector<CleapOption>& cleap_options() {
  static const std::vector<CleapOption> kOptions = {
      {"metric", "METRIC", "what an edge costs", joined(metric_names()),
       [](std::string_view text, CleapRequest& request) { return read_choice(text, metric_names(), &request.options.metric); }},
      {"pool", "SHARE", "try this share of the edges, the cheapest", "above 0, up to 1; default 0.8", apply_pool},
      choice(
          "selection",
          "how they are found: sorted, by a threshold, not at all, as the best at both their ends, or one each of vertices three "
          "edges apart",
          {"sort", "histogram", "unsorted", "vertex-best", "super-independent"}, &Options::selection),
      choice("shuffle", "in which order they are tried", {"fisher-yates", "keyed", "none"}, &Options::shuffle),
      number("seed", "S", "of the shuffle", {0, kMost}, "0 to 4294967295; default 1", &Options::seed),
      number("passes", "N", "find costs anew when a pool is used up, so often; 1 as published", {1, 1000},
             "1 to 1000; default 100", &Options::most_passes),
      number("window", "N", "candidates at the same time; 0: the whole pool", {0, kMost}, "0 to 4294967295; default 512",
             &Options::window),
      choice("lock", "who gets triangles that several want: the first in order, or who comes first", {"ordered", "raced"},
             &Options::lock),
      choice("order", "candidates ask for locks before they are tested, or after", {"lock-first", "test-first"}, &Options::order),
      yes_or_no("come-back", "who lost the lock-down is tried again", &Options::come_back),
      yes_or_no("closing", "what a collapse touched is left alone for the rest of the pass", &Options::closing),
      number("most-triangles", "C", "at a vertex that a collapse makes", {3, 1000}, "3 to 1000; default 14",
             &Options::most_triangles),
      choice("inversion", "what may not change: the sign of an area in the plan, or a normal, as listed", {"sign", "normals"},
             &Options::inversion),
      choice("border", "edges at the border stay, or are collapsed onto it and along it", {"keep", "collapse"}, &Options::border),
      choice("repair", "the arrays are repaired whole, or around collapses", {"everywhere", "around"}, &Options::repair),
      choice("rearrange", "gaps are closed in one pass, or one swap after the other; the result is the same",
             {"scan", "pointers"}, &Options::rearrange),
      choice("delaunay", "flip edges until they are Delaunay in the plan", {"none", "at-end", "between"}, &Options::delaunay,
             "WHEN"),
      {"smooth", "STEPS", "of Taubin's smoothing, at the end", "0 to 1000; default 0",
       [](std::string_view text, CleapRequest& request) {
         return whole(text, {0, 1000}, request.smooth);
       }},
  };
  return kOptions;
}

proto::Result<CleapRequest> checked_cleap(CleapRequest request, const std::string& strategy, const Given& given) {
  if (strategy != "sequential") return request;
  for (const char* name : {"--window", "--lock", "--come-back"}) {
    if (!is_given(given, name)) continue;
    return proto::Problem{"options-conflict", std::string("sequential tries one edge after the other: there is no ") + name,
                          "--strategy cleap", name};
  }
  request.options.window = 1;
  if (!is_given(given, "--repair")) request.options.repair = Repair::around;
  return request;
}

}  // namespace cordillera::server
