#pragma once
// JSON with members in the order they were added, so that documents are the same bytes every time and read well.
#include <nlohmann/json.hpp>

namespace cordillera::pipeline {
using Json = nlohmann::ordered_json;
}
