#pragma once
// The words of plan, tasks, work and publish, as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <vector>

#include "server/cli/work_commands.h"

namespace cordillera::server {

/// Of the options of a build those of the machine that does tasks: what else shapes it stands in the plan.
std::vector<OptionSpec> work_options();

class WorkWords {
 public:
  /// Adds the commands; add_build_options gives plan its options.
  void add_to(CLI::App& app);
  CLI::App* plan() const { return plan_; }
  CLI::App* work() const { return work_; }
  /// All four, for checks that every command gets.
  std::vector<CLI::App*> commands() const { return {plan_, tasks_, work_, publish_}; }
  /// Whether one of tasks and publish was asked for, and its exit code.
  std::optional<int> run();
  int run_plan(const Settings& settings) const { return plan_command(settings, plan_line_); }
  int run_work(const Settings& settings) const { return work_command(settings, work_line_); }

 private:
  CLI::App *plan_ = nullptr, *tasks_ = nullptr, *work_ = nullptr, *publish_ = nullptr;
  PlanLine plan_line_;
  WorkLine work_line_;
  PublishLine publish_line_;
  std::string formats_;
  std::string tasks_folder_;
  Show tasks_show_ = Show::table;
};

}  // namespace cordillera::server
