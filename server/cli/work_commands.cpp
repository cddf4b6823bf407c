#include "server/cli/work_commands.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>

#include "gpu/simplify.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/stage_memory.h"
#include "pipeline/work/work.h"
#include "pipeline/work/work_plan.h"
#include "proto/cores.h"
#include "proto/paths.h"
#include "proto/utf8.h"
#include "raster/disk/private_folder.h"
#include "raster/disk/this_machine.h"
#include "raster/storage/storage.h"
#include "server/http/json.h"
#include "server/memory/memory_limit.h"
#include "server/options/option_values.h"
#include "server/sandbox/asked_to_stop.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
namespace work = pipeline::work;
using proto::Problem;

/// The number that a scheduler gives to a task of an array of so many; empty where no scheduler says it and they are several.
std::string array_number(std::uint32_t parts) {
  for (const char* variable : {"SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX", "AWS_BATCH_JOB_ARRAY_INDEX"}) {
    if (const char* number = std::getenv(variable)) return number;
  }
  return parts == 1 ? "0" : "";
}

/// The tasks that a line asks for, of one stage.
proto::Result<std::vector<std::size_t>> tasks_of(const WorkLine& line, const proto::WorkStage& stage) {
  const auto tasks = static_cast<std::uint32_t>(stage.tasks_size());
  std::uint32_t task = 0, part = 0, parts = 1;
  if (!line.task.empty()) {
    if (const auto wrong = read_whole(line.task, {0, tasks - 1}, &task))
      return wrong_value("--task", line.task, *wrong, "0 to " + std::to_string(tasks - 1));
    return std::vector<std::size_t>{task};
  }
  const std::size_t slash = line.part.find('/');
  if (!line.part.empty()) {
    const bool counted = slash != std::string::npos && !read_whole(line.part.substr(slash + 1), {1, 1u << 24}, &parts);
    const std::string asked = line.part.substr(0, slash), number = asked == "array" ? array_number(parts) : asked;
    if (counted && asked == "array" && number.empty())
      return Problem{"option-invalid",
                     "--part='" + line.part +
                         "', and no scheduler says which part this is: none of SLURM_ARRAY_TASK_ID, "
                         "JOB_COMPLETION_INDEX and AWS_BATCH_JOB_ARRAY_INDEX is set",
                     "K/N with K from 0 to N - 1", "--part"};
    const bool right = counted && !read_whole(number, {0, parts - 1}, &part);
    if (!right) {
      return Problem{"option-invalid",
                     "--part='" + line.part + "'" +
                         (counted && number != asked ? ", here " + number + line.part.substr(slash) : "") + " is no K/N",
                     "K/N with K from 0 to N - 1, or array/N: the number that Slurm, Kubernetes or AWS Batch gives", "--part"};
    }
  }
  return work::part_of(stage, part, parts);
}

class TaskCounter {
 public:
  TaskCounter(std::size_t all, Verbosity words) : all_(all), words_(words) {}
  void ended(const proto::WorkTask& task, work::TaskOutcome outcome) {
    ++done_;
    if (words_ == Verbosity::none) return;
    std::cerr << done_ << "/" << all_ << " " << task.level() << "/" << task.x() << "/" << task.y()
              << (outcome == work::TaskOutcome::done       ? ""
                  : outcome == work::TaskOutcome::was_done ? " was there"
                                                           : " failed")
              << "\n";
  }

 private:
  std::size_t all_, done_ = 0;
  Verbosity words_;
};

/// One, or every GPU of the machine.
proto::Result<std::vector<std::string>> devices_of(const std::string& asked) {
  if (asked.empty()) return std::vector<std::string>{"auto"};
  if (asked != kEveryGpu) return std::vector<std::string>{asked};
  std::vector<std::string> devices;
  for (int k = 0; k < gpu::cuda_devices(); ++k) devices.push_back("cuda:" + std::to_string(k));
  if (devices.empty())
    return Problem{"device-unavailable", "--device='cuda:all': there is no GPU that this program may use", "auto, cpu",
                   "--device"};
  return devices;
}

/// Where a worker begins, so that several with the same line do not do the same tasks side by side: each finds what others did.
std::size_t own_begin() { return std::hash<std::string>()(raster::host_name() + std::to_string(getpid())); }

/// Without memory in machine, what the plan was made with.
proto::Result<void> do_stage(const proto::WorkPlan& plan, int number, const WorkLine& line, const proto::BuildOptions& machine) {
  const proto::WorkStage& stage = plan.stages(number);
  const auto tasks = tasks_of(line, stage);
  if (!tasks) return tasks.problem();
  const auto devices = devices_of(machine.device());
  if (!devices) return devices.problem();
  work::WorkOrder order{line.folder, *devices, machine.threads(),
                        machine.memory() > 0 ? machine.memory() : plan.options().memory(), line.part.empty() ? own_begin() : 0};
  if (order.memory_mib > 0)
    order.threads = std::min(proto::threads_for(order.threads), std::max(1u, order.memory_mib / kMemoryPerThread_mib));
  TaskCounter counter(tasks->size(), line.words);
  const auto done = work::do_tasks(
      plan, stage, *tasks, order, [&](const proto::WorkTask& task, work::TaskOutcome outcome) { counter.ended(task, outcome); },
      g_asked_to_stop);
  if (done || done.problem().type != pipeline::kCancelled.type) return done;
  return Problem{"cancelled", "the work was stopped; the same line goes on with the tasks that are not done", "", ""};
}

int say(const proto::WorkPlan& plan, const std::string& folder) {
  const auto stages = work::progress_of(plan, folder);
  if (!stages) return give_up(stages.problem());
  double samples = 0;
  for (const proto::WorkTask& task : plan.stages(0).tasks()) samples += task.samples();
  std::cout << counted(static_cast<std::size_t>(plan.sources_size()), "raster") << ", levels " << plan.plan().min_level()
            << " to " << plan.plan().finest_level() << ", " << samples / 1e6 << " million samples\n";
  for (std::size_t s = 0; s < stages->size(); ++s) {
    std::cout << "stage " << s << (s == 0 ? " (blocks): " : " (levels above): ") << counted((*stages)[s].all, "task") << ", "
              << (*stages)[s].done << " done\n";
  }
  return kDone;
}

/// Tasks are done in other folders than this: files that are named get their whole paths.
void find_from_anywhere(pipeline::BuildRequest& request) {
  const auto whole = [](const std::string& path) {
    std::error_code error;
    return fs::is_regular_file(path, error) ? fs::absolute(path).lexically_normal().string() : path;
  };
  const auto of_options = [&](proto::BuildOptions& options) {
    if (!options.vertical_datum().empty()) options.set_vertical_datum(whole(options.vertical_datum()));
    if (!options.water_mask().empty()) options.set_water_mask(whole(options.water_mask()));
  };
  of_options(request.options);
  for (raster::MosaicMember& member : request.members) {
    member.path = whole(member.path);
    of_options(member.options);
  }
}

/// A plan takes the place of an earlier one, whose results stay; in another folder it would be lost among what is there.
proto::Result<void> check_plan_folder(const std::string& folder) {
  std::error_code error;
  if (raster::is_remote(folder) || !fs::exists(folder, error)) return {};
  if (!fs::is_directory(folder, error))
    return Problem{"output-failed", folder + " is there and no folder", "a folder that is empty or holds a plan", "--output"};
  if (fs::is_empty(folder, error) || fs::exists(fs::path(folder) / work::kPlanFile, error)) return {};
  return Problem{"output-exists", folder + " holds something else than a plan", "a folder that is empty or holds a plan",
                 "--output"};
}

/// A single raster gives its name to its dataset, several the folder of their plan, as those of build do.
std::string name_of_plan(const std::vector<raster::MosaicMember>& members, const std::string& folder) {
  if (members.size() == 1) return fs::path(members.front().path).filename().string();
  if (folder.empty()) return "";  // a dry run needs none
  return proto::place_of(folder).filename().string();
}

}  // namespace

int give_up(const Problem& problem) {
  complain(problem);
  return work::worth_retrying(problem) ? kTryAgain : kFailed;
}

std::string counted(std::size_t count, const char* what) { return std::to_string(count) + " " + what + (count == 1 ? "" : "s"); }

int plan_command(const Settings& settings, const PlanLine& line) {
  if (line.folder.empty() && !settings.dry_run)
    return wrong_usage({"usage", "plan needs to know where to write", "-o FOLDER", "--output"});
  work::PlanGiven given;
  if (!line.block.empty()) {
    std::uint32_t side = 0;
    if (const auto wrong = read_whole(line.block, {512, 4096}, &side))
      return wrong_usage({"usage", "--block='" + line.block + "': " + *wrong, "512 to 4096", "--block"});
    given.block_samples = (std::int64_t{side} + 1) * (side + 1);
  }
  if (const auto usable = check_plan_folder(line.folder); !usable) return give_up(usable.problem());
  raster::remove_left_folders();
  auto sources = examine_sources(line.sources, settings, line.bad);
  if (!sources) return give_up(sources.problem());
  for (const raster::MosaicMember& member : sources->members) {
    if (proto::is_utf8(member.path)) continue;
    return give_up({"option-invalid",
                    "the name of " + proto::as_utf8(member.path) + " is no UTF-8, as the text of a plan must be",
                    "a name in UTF-8", "SOURCES"});
  }
  stop_on({SIGINT, SIGTERM, SIGHUP},
          SecondTime::ends);  // until here nothing asks whether to stop, and an end in the middle leaves nothing
  pipeline::BuildRequest request;
  request.members = std::move(sources->members);
  request.options = settings.build;
  for (const std::string& note : sources->notes) request.options.add_warnings(note);
  find_from_anywhere(request);
  request.raster_name = settings.build.name().empty() ? name_of_plan(request.members, line.folder) : settings.build.name();
  if (settings.dry_run) return dry_run(request, Show::table);
  auto plan = work::plan_work(request, g_asked_to_stop, given);
  if (!plan) return give_up(plan.problem());
  for (const std::string& skipped : sources->skipped) plan->add_skipped(proto::as_utf8(skipped));
  for (const std::string& warning : settings.build.warnings()) plan->add_warnings(warning);
  for (const std::string& warning : sources->warnings) plan->add_warnings(proto::as_utf8(warning));
  if (const auto written = work::write_plan(*plan, line.folder); !written) return give_up(written.problem());
  for (const std::string& skipped : plan->skipped()) std::cerr << "cordillera: left out: " << skipped << "\n";
  for (const std::string& warning : plan->warnings()) std::cerr << "cordillera: warning: " << warning << "\n";
  if (line.words == Verbosity::all) return say(*plan, line.folder);
  return kDone;
}

int work_command(const Settings& settings, const WorkLine& line) {
  if (!line.task.empty() && !line.part.empty())
    return wrong_usage({"usage", "--task is one task, and --part several", "one of the two", "--part"});
  stop_on({SIGINT, SIGTERM, SIGHUP}, SecondTime::ends);
  raster::remove_left_folders();
  const auto plan = work::read_plan(line.folder);
  if (!plan) return give_up(plan.problem());
  if (line.stage.empty()) {
    if (!line.task.empty() || !line.part.empty()) {
      return wrong_usage({"usage",
                          std::string(line.part.empty() ? "--task is one task" : "--part is a part") +
                              " of one stage, and --stage does not say of which",
                          "--stage 0 for the blocks, or a higher stage that `cordillera tasks` lists", "--stage"});
    }
    for (int s = 0; s < plan->stages_size(); ++s) {
      if (const auto done = do_stage(*plan, s, line, settings.build); !done) return give_up(done.problem());
    }
    return kDone;
  }
  std::uint32_t stage = 0;
  const auto last = static_cast<std::uint32_t>(plan->stages_size() - 1);
  if (const auto wrong = read_whole(line.stage, {0, last}, &stage)) {
    return wrong_usage({"usage", "--stage='" + line.stage + "': " + *wrong, "0 to " + std::to_string(last), "--stage"});
  }
  const auto done = do_stage(*plan, static_cast<int>(stage), line, settings.build);
  if (done) return kDone;
  return done.problem().type == "option-invalid" ? wrong_usage(done.problem()) : give_up(done.problem());
}

int tasks_command(const std::string& folder, Show show) {
  const auto plan = work::read_plan(folder);
  if (!plan) return give_up(plan.problem());
  if (show == Show::table) { return say(*plan, folder); }
  const auto stages = work::progress_of(*plan, folder);
  if (!stages) return give_up(stages.problem());
  Json json = Json::array();
  for (std::size_t s = 0; s < stages->size(); ++s) {
    double cost = 0;
    for (const proto::WorkTask& task : plan->stages(static_cast<int>(s)).tasks()) cost += work::cost_of(task);
    json.push_back({{"stage", s},
                    {"tasks", (*stages)[s].all},
                    {"done", (*stages)[s].done},
                    {"cost", cost},
                    {"memory_mib", work::memory_mib_of(*plan, s)}});
  }
  std::cout << dump(plain_numbers(json)) << "\n";
  return kDone;
}

}  // namespace cordillera::server
