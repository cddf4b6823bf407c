#include "server/api/requests/query_words.h"

namespace cordillera::server {
namespace {

constexpr std::uint32_t kLastPosition = 1u << 20;

/// The names of a raster that is not the body first: without a raster in the body nothing goes without them.
const std::vector<OptionOf<RasterWords>>& raster_words() {
  const auto kept_in = [](std::string RasterWords::*into) {
    return [into](std::string_view text, RasterWords& words) {
      words.*into = std::string(text);
      return text.empty() ? Complaint("empty") : std::nullopt;
    };
  };
  static const std::vector<OptionOf<RasterWords>> kRows = {
      {"source", "ADDRESS", "an address that the operator lets the service fetch; then there is no body", "an address",
       kept_in(&RasterWords::address)},
      {"upload", "ID", "id of an upload that is complete; then there is no body", "the id of an upload",
       kept_in(&RasterWords::upload)},
  };
  return kRows;
}

template <std::string* (proto::BuildOptions::*field)()>
Complaint take_text(std::string_view text, Dataset& dataset) {
  return read_text(text, (dataset.options.*field)());
}

Complaint take_imagery(std::string_view text, Dataset& dataset) {
  if (!text.empty()) return read_imagery(text, dataset.options.mutable_imagery());
  dataset.options.clear_imagery();
  return std::nullopt;
}

Complaint take_build(std::string_view text, Dataset& dataset) {
  std::string full;
  Complaint complaint = read_choice(text, {"full"}, &full);
  if (!complaint) dataset.options.clear_build();
  return complaint;
}

}  // namespace

const std::vector<OptionOf<PostWords>>& post_words() {
  static const std::vector<OptionOf<PostWords>> kRows = [] {
    std::vector<OptionOf<PostWords>> rows = lifted(raster_words(), &PostWords::raster);
    rows.push_back(
        OptionOf<PostWords>{"updates", "", "keep what it takes to add, replace and remove rasters later", "1 or 0",
                            [](std::string_view text, PostWords& words) { return read_switch(text, &words.updates.emplace()); }});
    for (auto& row : lifted(post_options(), &PostWords::settings)) rows.push_back(std::move(row));
    return rows;
  }();
  return kRows;
}

std::optional<proto::Problem> unknown_in_body(const Given& options, const std::string& kind) {
  const std::vector<OptionName> names = names_in(post_words());
  for (const auto& [name, value] : options) {
    if (!place_of(name, names, Spelling::query)) return unknown_option(name, names, {.what = "unknown " + kind});
  }
  return std::nullopt;
}

const std::vector<OptionOf<ChangeWords>>& change_words() {
  static const std::vector<OptionOf<ChangeWords>> kRows = [] {
    std::vector<OptionOf<ChangeWords>> rows = lifted(raster_words(), &ChangeWords::raster);
    rows.push_back(OptionOf<ChangeWords>{"position", "N", "where it stands in the list; 0, the default of a new one, wins",
                                         "0 for the raster that wins, 1 for the next, and so on",
                                         [](std::string_view text, ChangeWords& words) {
                                           return read_whole(text, {0, kLastPosition}, &words.position.emplace());
                                         }});
    for (auto& row : lifted(raster_options(), &ChangeWords::settings)) rows.push_back(std::move(row));
    return rows;
  }();
  return kRows;
}

const std::vector<OptionOf<LiveWords>>& live_words() {
  static const std::vector<OptionOf<LiveWords>> kRows = [] {
    std::vector<OptionOf<LiveWords>> rows = {
        {"url", "ADDRESS", "the address of a raster", "an address that the operator allows",
         [](std::string_view text, LiveWords& words) { return words.url = std::string(text), Complaint(); }}};
    for (auto& row : lifted(post_options(), &LiveWords::settings)) {
      if (row.name != "build" && row.name != "provisional" && row.name != "dry-run") rows.push_back(std::move(row));
    }
    return rows;
  }();
  return kRows;
}

const std::vector<OptionOf<Dataset>>& description_words() {
  static const std::vector<OptionOf<Dataset>> kRows = {
      {"title", "TEXT", "its title; empty: its name", "text", take_text<&proto::BuildOptions::mutable_title>},
      {"attribution", "TEXT", "who is named with it; empty: nobody", "text",
       take_text<&proto::BuildOptions::mutable_attribution>},
      {"imagery", "ADDRESS", "pictures that pages lay on the terrain; empty: none", kImagery, take_imagery},
      {"private", "", "read with a token only; 0: by everybody", "1 or 0",
       [](std::string_view text, Dataset& dataset) { return read_switch(text, &dataset.is_private); }},
      {"build", "full", "all blocks are made from now on", "full", take_build},
  };
  return kRows;
}

}  // namespace cordillera::server
