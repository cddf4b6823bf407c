#pragma once
// Which of the datasets a list asks for: the query of GET /v1/datasets.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "server/datasets/registry.h"
#include "server/options/table_reader.h"

namespace cordillera::server {

/// The greatest place of a page: a client that reads it as a double has it exactly.
inline constexpr std::int64_t kLastPlace = (std::int64_t{1} << 53) - 1;

struct ListQuery {
  std::uint32_t limit = 100;
  std::int64_t after = kBeforeAll;           ///< only those with a lower number: the end of the page before
  std::vector<State> states;                 ///< empty: all
  std::optional<std::array<double, 4>> box;  ///< west, south, east, north, degrees; west above east crosses the antimeridian
  std::string text;                          ///< in lower case
};

using ListOption = OptionOf<ListQuery>;
const std::vector<ListOption>& list_options();
/// Problems: "option-unknown", "option-repeated", "option-invalid".
proto::Result<ListQuery> list_query(const Given& given);

}  // namespace cordillera::server
