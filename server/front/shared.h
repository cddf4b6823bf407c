#pragma once
// What all connections of a server share.
#include <atomic>

#include "server/api/api.h"
#include "server/front/answer_budget.h"
#include "server/front/client_counts.h"
#include "server/front/content_coding.h"
#include "server/front/kept_answers.h"
#include "server/front/message/limits.h"
#include "server/front/served.h"
#include "server/front/workers.h"

namespace cordillera::server::front {

struct Shared {
  Shared(Api& api_, const HttpLimits& limits_, OnServed on_served_);

  Api& api;
  const HttpLimits limits;
  const OnServed on_served;
  ContentCoder coder;
  KeptAnswers kept;
  ClientCounts connections, streams;
  AnswerBudget unsent;
  std::atomic<std::size_t> sockets{0};  ///< open, of refused clients too; before the workers, whose works hold some
  Workers makers;                       ///< requests without a body that are not answered at once
  Workers takers;                       ///< requests with one: they may wait for their client
  std::atomic<bool> stopping{false};
};

/// The API's answer, ready for the socket. Whatever is thrown becomes a problem.
Response answer_of(Shared& shared, const Request& request, const Route& route);
/// The rest of an answer that was put off, likewise.
Response rest_of(Shared& shared, const Request& request, const std::function<Response()>& rest);
/// The answer, if it was given to somebody lately and is the same for all; nothing: it has to be made.
std::optional<Response> kept_answer(Shared& shared, const Request& request);
/// Why nothing large is sent now.
proto::Problem too_much_unsent();
/// A problem that the front itself has.
Response refusal(const proto::Problem& problem);

}  // namespace cordillera::server::front
