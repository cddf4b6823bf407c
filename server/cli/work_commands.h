#pragma once
// cordillera plan, work, publish: a build that a scheduler spreads over machines.
#include <string>
#include <vector>

#include "server/cli/commands.h"
#include "server/cli/sources.h"

namespace cordillera::server {

struct PlanLine {
  std::vector<std::string> sources;
  std::string folder;
  std::string block;  ///< samples along the side of a block, at most; empty: as memory allows
  BadSource bad = BadSource::refuse;
  Verbosity words = Verbosity::all;
};
int plan_command(const Settings& settings, const PlanLine& line);

struct WorkLine {
  std::string folder;
  std::string stage;  ///< a number; empty: all of them, one after the other
  std::string task;   ///< a number, or
  std::string part;   ///< K/N: the K-th of N parts of about equal cost, from 0; neither: all tasks of the stage
  Verbosity words = Verbosity::all;
};
/// --device of `work`, beside those of a build.
inline constexpr const char* kEveryGpu = "cuda:all";
/// settings: device, threads and memory, of this line or the environment.
int work_command(const Settings& settings, const WorkLine& line);

struct PublishLine : OutputLine {
  std::string folder;  ///< of the plan
  bool prune = false;  ///< shards that this plan does not name
};
int publish_command(const PublishLine& line);

/// How far each stage is; --json for programs.
int tasks_command(const std::string& folder, Show show);

/// Complains; the exit code says whether it may go better later.
int give_up(const proto::Problem& problem);
/// "1 task", "2 tasks".
std::string counted(std::size_t count, const char* what);

}  // namespace cordillera::server
