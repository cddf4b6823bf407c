#pragma once
// Which HTTP status a problem is, and what it is called: one table for the whole service.
#include <string>
#include <string_view>
#include <vector>

namespace cordillera::server {

struct ProblemKind {
  std::string slug;  ///< Problem::type
  int status = 0;
  std::string title;
};

/// The entry of a slug. One that the table does not know is of the command line: 422, and most titles are made from its words.
ProblemKind problem_kind(std::string_view slug);

/// Whether it is of a command that talks to a service, and so never had a status.
bool is_of_commands(std::string_view slug);

/// Every slug that a client may be told, for the API's description.
std::vector<ProblemKind> all_problem_kinds();

}  // namespace cordillera::server
