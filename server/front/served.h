#pragma once
// What is told of every request once it is over: for logs and metrics.
#include <cstdint>
#include <functional>
#include <string>

namespace cordillera::server::front {

struct Served {
  std::string method, path;  ///< empty where the head could not be read
  std::string client;        ///< address; of who stands behind a trusted proxy
  std::string problem;       ///< slug; empty: none
  int status = 0;
  std::uint64_t bytes = 0;  ///< of the answer that the system took, head included
  double seconds = 0;       ///< from the end of the request's head to there
  bool by_front = false;    ///< refused before the API was asked, or in the place of its answer
  bool counted = true;      ///< the API has told the metrics of it
  std::string route;        ///< its name, where nobody has counted it
  bool whole = true;        ///< false: the client went, or was too slow, before the end
};

/// Called on the server's own threads: must be quick and thread-safe.
using OnServed = std::function<void(const Served&)>;

}  // namespace cordillera::server::front
