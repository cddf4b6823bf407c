#include "pipeline/encode/strange_json.h"

#include <vector>

namespace cordillera::pipeline {

Json json_of_stranger(std::string_view text) {
  bool within = true;
  std::uint64_t compared = 0;
  std::vector<std::uint64_t> members;  // of the objects that are open
  const Json::parser_callback_t look = [&](int depth, Json::parse_event_t event, Json&) {
    within = within && depth <= kMostNested;
    if (!within) return false;
    if (event == Json::parse_event_t::object_start) members.push_back(0);
    if (event == Json::parse_event_t::object_end) members.pop_back();
    if (event == Json::parse_event_t::key) within = (compared += members.back()++) <= kMostCompared;
    return within;
  };
  Json json = Json::parse(text, look, false);
  return within ? json : Json(Json::value_t::discarded);
}

}  // namespace cordillera::pipeline
