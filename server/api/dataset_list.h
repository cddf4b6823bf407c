#pragma once
// GET /v1/datasets: a page of the datasets that the asker may see. What a page costs does not grow with the number of datasets.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/datasets/library.h"
#include "server/http/message.h"
#include "server/options/option_values.h"
#include "server/options/options.h"
#include "server/datasets/registry.h"

namespace cordillera::server {

class Service;

struct ListQuery {
  std::uint32_t limit = 100;
  std::int64_t after = kBeforeAll;            ///< only those with a lower number: the end of the page before
  std::vector<State> states;                  ///< empty: all
  std::optional<std::array<double, 4>> box;   ///< west, south, east, north, degrees; west above east crosses the antimeridian
  std::string text;                           ///< in lower case
};

struct ListOption {
  std::string name, help, accepted;
  Complaint (*apply)(std::string_view text, ListQuery& query);
};
const std::vector<ListOption>& list_options();
/// Problems: "option-unknown", "option-repeated", "option-invalid".
proto::Result<ListQuery> list_query(const Given& given);

/// Mounted ones first, then newest first.
struct Page {
  std::vector<Row> rows;
  std::optional<std::int64_t> next;  ///< `after` of the next page; nothing: this is the last one
};
Page page_of(Service& service, const Request& request, const ListQuery& query);

/// The whole answer to GET /v1/datasets.
Response dataset_list(Service& service, const Request& request);

}  // namespace cordillera::server
