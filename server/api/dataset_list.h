#pragma once
// GET /v1/datasets: a page of the datasets that the asker may see. What a page costs does not grow with the number of datasets.
#include <cstdint>
#include <optional>
#include <vector>

#include "server/api/requests/list_query.h"
#include "server/http/message.h"

namespace cordillera::server {

class Service;

/// Mounted ones first, then newest first.
struct Page {
  std::vector<Row> rows;
  std::optional<std::int64_t> next;  ///< `after` of the next page; nothing: this is the last one
};
Page page_of(Service& service, const Request& request, const ListQuery& query);

/// The whole answer to GET /v1/datasets.
Response dataset_list(Service& service, const Request& request);

}  // namespace cordillera::server
