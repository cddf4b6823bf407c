#pragma once
// Calls that are tried again while there is hope, and what is said of those that fail.
#include <chrono>
#include <string>

#include "server/cli/commands.h"
#include "server/client/connection.h"
#include "server/http/json.h"

namespace cordillera::server::client {

/// How long a service may be away once it has been heard, since something last moved.
inline constexpr std::chrono::seconds kPatience{120};

class Talk {
 public:
  Talk(const ServiceAddress& place, Verbosity words) : connection_(place), address_(place.address()), words_(words) {}

  /// One call. The first one that is answered makes later ones patient.
  Answer once(const Call& call);
  /// For a call that does no harm twice: again and again while may_help().
  Answer patiently(const Call& call);
  /// Whether to try again after this answer. Waits before it says yes: as long as the service asked for, or longer each time.
  bool may_help(const Answer& answer);
  /// Something begins, or got done: patience begins anew.
  void moved();
  const std::string& address() const { return address_; }

  /// What the answer says is wrong, or the way to it.
  proto::Problem problem_of(const Answer& answer) const;

 private:
  Connection connection_;
  std::string address_;
  Verbosity words_;
  bool heard_ = false;
  std::string not_ready_;  ///< what the service said last of something that is still to be made
  std::chrono::milliseconds pause_{250};
  std::chrono::steady_clock::time_point moved_ = std::chrono::steady_clock::now();
};

/// Of an answer's object, on one line and without what a terminal would obey; empty: there is no such text.
std::string text_in(const Json& json, const char* name);
/// The problem in an answer (RFC 9457). Where the members are missing, detail is the text itself.
proto::Problem problem_in(const Json& json);

/// 1, 2 where the command line is wrong, 75 where trying again may help.
int exit_code(const proto::Problem& problem);

/// The problem as JSON. One that no service told has no status.
Json told_json(const proto::Problem& problem);

/// Title, detail and what would be accepted to stderr, or the problem as a line of JSON to stdout. Gives the exit code.
int tell(const proto::Problem& problem, Show show);

/// The object that the answer's body is; an empty one if it is none.
Json object_in(const Answer& answer);

}  // namespace cordillera::server::client
