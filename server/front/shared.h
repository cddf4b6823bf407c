#pragma once
// What all connections of a server share.
#include <atomic>

#include "server/api.h"
#include "server/front/client_counts.h"
#include "server/front/content_coding.h"
#include "server/front/limits.h"
#include "server/front/served.h"
#include "server/front/workers.h"

namespace cordillera::server::front {

struct Shared {
  Shared(Api& api_, const Limits& limits_, OnServed on_served_);

  Api& api;
  const Limits limits;
  const OnServed on_served;
  ContentCoder coder;
  ClientCounts connections, streams;
  Workers makers;  ///< requests without a body that are not answered at once
  Workers takers;  ///< requests with one: they may wait for their client
  std::atomic<bool> stopping{false};
};

/// The API's answer, ready for the socket. Whatever is thrown becomes a problem.
Response answer_of(Shared& shared, const Request& request);
/// A problem that the front itself has.
Response refusal(const proto::Problem& problem);

}  // namespace cordillera::server::front
