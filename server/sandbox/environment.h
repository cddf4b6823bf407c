#pragma once
// What of the service's environment its jobs get: variables with a name here, and no other. It may hold
// keys and passwords.
#include <string>
#include <vector>

namespace cordillera::server::sandbox {

struct Variable {
  const char* name;
  const char* why;
};

/// The table.
const std::vector<Variable>& variables_of_jobs();

/// Names further variables for jobs, separated by commas: for an operator who knows why.
inline constexpr const char* kFurtherVariables = "CORDILLERA_JOB_ENVIRONMENT";

/// NAME=VALUE of those that are set here.
std::vector<std::string> environment_of_jobs();

}  // namespace cordillera::server::sandbox
