#include "server/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>

#include "server/json.h"
#include "server/log.h"

namespace cordillera::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(5);         // between SIGTERM and SIGKILL
constexpr std::size_t kLongestLine = std::size_t{1} << 20;  // a child gone mad must not fill our memory

struct Child {
  pid_t pid = -1;
  int report = -1;  ///< our end of the pipe
};

std::optional<Child> spawn(const std::string& program, const std::string& folder) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return std::nullopt;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, 2, 1);  // a library that prints must not meet a closed stdout
  posix_spawn_file_actions_adddup2(&actions, ends[1], kReportDescriptor);
  // Accepted sockets are not close-on-exec: a child that held them would keep clients waiting.
  posix_spawn_file_actions_addclosefrom_np(&actions, kReportDescriptor + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);  // Ctrl-C is the server's to handle
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

  const std::string parent = std::to_string(getpid());
  const char* arguments[] = {"cordillera", "job", folder.c_str(), "--parent", parent.c_str(), nullptr};
  Child child;
  const int failed =
      posix_spawn(&child.pid, program.c_str(), &actions, &attributes, const_cast<char* const*>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  close(ends[1]);
  if (failed) {
    close(ends[0]);
    return std::nullopt;
  }
  child.report = ends[0];
  return child;
}

/// What the child said, line by line.
struct Report {
  const ProgressSink& sink;
  std::optional<proto::Problem> problem;
  std::optional<proto::Estimate> estimate;
  std::string rest;

  void line(const std::string& text) {
    proto::Progress progress;
    if (!from_json(text, &progress)) return;
    if (progress.has_error()) {
      problem = to_problem(progress.error());
    } else if (progress.has_estimate()) {
      estimate = progress.estimate();
    } else if (sink) {
      sink(progress);
    }
  }

  void take(const char* bytes, std::size_t count) {
    rest.append(bytes, count);
    std::size_t start = 0;
    for (auto end = rest.find('\n'); end != std::string::npos; end = rest.find('\n', start)) {
      line(rest.substr(start, end - start));
      start = end + 1;
    }
    rest.erase(0, start);
    if (rest.size() > kLongestLine) rest.clear();
  }
};

/// Reads until the child closes its end; asks it, then forces it, to end when stop is set.
void listen_to(const Child& child, Report& report, const std::atomic<bool>& stop) {
  std::optional<Clock::time_point> asked;
  while (true) {
    if (stop && !asked) {
      asked = Clock::now();
      kill(child.pid, SIGTERM);
    }
    if (asked && Clock::now() - *asked > kPatience) kill(child.pid, SIGKILL);
    pollfd wait{child.report, POLLIN, 0};
    if (poll(&wait, 1, 100) <= 0) continue;
    char bytes[4096];
    const ssize_t count = read(child.report, bytes, sizeof bytes);
    if (count > 0) report.take(bytes, static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && errno != EINTR)) return;
  }
}

/// The pipe is closed, so the child is about to end; one that does not is made to.
int reap(pid_t pid, const std::atomic<bool>& stop) {
  const auto start = Clock::now();
  int status = 0;
  while (true) {
    const pid_t ended = waitpid(pid, &status, WNOHANG);
    if (ended == pid || (ended < 0 && errno != EINTR)) return status;
    if (Clock::now() - start > (stop ? kPatience : 6 * kPatience)) kill(pid, SIGKILL);
    usleep(5000);
  }
}

proto::Problem crashed(int status) {
  // The clock that the job has set itself: no handler, so that nothing inside it can be in the way.
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    return {"build-time-limit", "the build took longer than this service lets one take; GET /v1/limits says how long that is",
            "a smaller raster, a coarser error= or a bbox=", ""};
  }
  std::string how = "with exit code " + std::to_string(WEXITSTATUS(status));
  if (WIFSIGNALED(status)) {
    const char* name = sigabbrev_np(WTERMSIG(status));
    how = std::string("by signal SIG") + (name ? name : std::to_string(WTERMSIG(status)).c_str());
  }
  return {"job-crashed", "the process that built this dataset was ended " + how + "; the service itself is unharmed",
          "posting again, with fewer threads= or less memory= if the machine ran out of memory", ""};
}

proto::Result<std::optional<proto::Estimate>> run(const std::string& program, const std::filesystem::path& folder,
                                                  const ProgressSink& progress, const std::atomic<bool>& stop) {
  const auto child = spawn(program, folder.string());
  if (!child)
    return proto::Problem{"internal", "cannot start the process that builds: " + std::string(strerror(errno)), "", ""};
  log_debug("job " + folder.filename().string() + " runs as process " + std::to_string(child->pid));
  Report report{progress, {}, {}, {}};
  try {
    listen_to(*child, report, stop);
  } catch (...) {  // of what its report says: the job must not go on behind the back of the next one
    kill(child->pid, SIGKILL);
    close(child->report);
    reap(child->pid, stop);
    throw;
  }
  close(child->report);
  const int status = reap(child->pid, stop);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return report.estimate;
  if (stop) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
  if (report.problem) return *report.problem;
  return crashed(status);
}

}  // namespace

JobRunner child_runner(const std::string& program) {
  return [program](const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop) {
    return run(program, folder, progress, stop);
  };
}

}  // namespace cordillera::server
