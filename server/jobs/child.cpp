#include "server/jobs/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>

#include "pipeline/build/build.h"
#include "proto/files.h"
#include "proto/paths.h"
#include "raster/disk/descriptor.h"
#include "server/fetch/range_asks.h"
#include "server/http/json.h"
#include "server/jobs/job_words.h"
#include "server/log/log.h"
#include "server/sandbox/environment.h"

namespace cordillera::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(5);  // between SIGTERM and SIGKILL
constexpr auto kGrace = std::chrono::seconds(30);    // for a job that is about to end by itself
constexpr std::size_t kLongestSlug = 60;
constexpr std::size_t kLongestLine = std::size_t{1} << 20;  // a child gone mad must not fill our memory

struct Program {
  std::string path;
  std::uint32_t free_percent = 0;  ///< of its folder's disk, that it leaves free
};

struct Child {
  pid_t pid = -1;
  raster::Descriptor report;  ///< our end of the pipe
  raster::Descriptor words;   ///< the same of its stderr
};

struct Pipe {
  raster::Descriptor ours, theirs;
  bool open() {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return false;
    ours = raster::Descriptor(ends[0]), theirs = raster::Descriptor(ends[1]);
    return true;
  }
};

/// What the process is started with besides its words: descriptors, signals, and a session of its own, so that neither Ctrl-C nor
/// a terminal is shared with it.
class Start {
 public:
  /// asks: -1: none.
  Start(int report, int words, int asks) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_adddup2(&actions_, words, 2);
    posix_spawn_file_actions_adddup2(&actions_, 2, 1);  // a library that prints must not meet a closed stdout
    // The place of one may be where another is: the report waits in place of stdin.
    posix_spawn_file_actions_adddup2(&actions_, report, 0);
    if (asks >= 0) posix_spawn_file_actions_adddup2(&actions_, asks, updates::kAskDescriptor);
    posix_spawn_file_actions_adddup2(&actions_, 0, kReportDescriptor);
    posix_spawn_file_actions_addopen(&actions_, 0, "/dev/null", O_RDONLY, 0);
    // Accepted sockets are not close-on-exec: a child that held them would keep clients waiting.
    posix_spawn_file_actions_addclosefrom_np(&actions_, (asks >= 0 ? updates::kAskDescriptor : kReportDescriptor) + 1);
    posix_spawnattr_init(&attributes_);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &all);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID);
  }
  ~Start() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  Start(const Start&) = delete;
  Start& operator=(const Start&) = delete;

  /// 0, or the error.
  int run(pid_t& pid, const Program& program, const std::string& folder) {
    const std::string parent = std::to_string(getpid()), free = std::to_string(program.free_percent);
    const char* arguments[] = {"cordillera",     "job",        folder.c_str(), "--parent", parent.c_str(),
                               "--free-percent", free.c_str(), nullptr};
    std::vector<std::string> variables = sandbox::environment_of_jobs();
    std::vector<char*> environment;
    for (std::string& variable : variables) environment.push_back(variable.data());
    environment.push_back(nullptr);
    return posix_spawn(&pid, program.path.c_str(), &actions_, &attributes_, const_cast<char* const*>(arguments),
                       environment.data());
  }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

/// Leaves in errno why it could not.
std::optional<Child> spawn(const Program& program, const std::string& folder, int asks) {
  Pipe report, words;
  Child child;
  if (!report.open() || !words.open() ||
      (errno = Start(report.theirs.number(), words.theirs.number(), asks).run(child.pid, program, folder)) != 0)
    return std::nullopt;
  child.report = std::move(report.ours), child.words = std::move(words.ours);
  return child;
}

/// What the child said, line by line.
struct ChildReport {
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

  /// What the job failed for is told all the same: it stands before what made the line long.
  void too_long() {
    static constexpr std::string_view kBefore = "\"error\":{\"type\":\"";
    const auto at = rest.find(kBefore);
    if (problem || at == std::string::npos) return;
    const std::string slug = rest.substr(at + kBefore.size(), kLongestSlug);
    problem = proto::Problem{slug.substr(0, slug.find('"')), "the build failed, and what it said of it is too long to be shown",
                             "", ""};
  }

  void take(const char* bytes, std::size_t count) {
    rest.append(bytes, count);
    std::size_t start = 0;
    for (auto end = rest.find('\n'); end != std::string::npos; end = rest.find('\n', start)) {
      line(rest.substr(start, end - start));
      start = end + 1;
    }
    rest.erase(0, start);
    if (rest.size() <= kLongestLine) return;
    too_long();
    rest.clear();
  }
};

/// The job's own clock (alarm) with time to spare: a job that was taken over may have stopped that one.
std::optional<Clock::time_point> deadline_of(const std::filesystem::path& folder) {
  const auto text = proto::bytes_of_file(folder / kJobFile);
  proto::Job job;
  if (!text || !from_json(*text, &job) || job.max_seconds() == 0) return std::nullopt;
  return Clock::now() + std::chrono::seconds(job.max_seconds()) + kPatience;
}

/// A process from its start to its end: what it says, and what makes it end.
class ChildWatch {
 public:
  ChildWatch(Child child, const std::filesystem::path& folder, const std::atomic<bool>& stop)
      : child_(std::move(child)), stop_(stop), deadline_(deadline_of(folder)), words_(folder.filename().string()) {
    fcntl(child_.words.number(), F_SETFL, O_NONBLOCK);
  }

  bool late() const { return late_; }

  /// Reads until the child closes its end; asks it, then forces it, to end when it is to stop, and ends it when its time is over.
  void listen_to(ChildReport& report) {
    std::optional<Clock::time_point> asked;
    while (true) {
      if (stop_ && !asked) {
        asked = Clock::now();
        kill(child_.pid, SIGTERM);
      }
      if (asked && Clock::now() - *asked > kPatience) kill(child_.pid, SIGKILL);
      end_if_late();
      pollfd wait[] = {{child_.report.number(), POLLIN, 0}, {silent_ ? -1 : child_.words.number(), POLLIN, 0}};
      if (poll(wait, 2, 100) <= 0) continue;
      if (wait[1].revents != 0) hear();
      if (wait[0].revents == 0) continue;
      char bytes[4096];
      const ssize_t count = read(child_.report.number(), bytes, sizeof bytes);
      if (count > 0) report.take(bytes, static_cast<std::size_t>(count));
      if (count == 0 || (count < 0 && errno != EINTR)) return;
    }
  }

  /// The pipe is closed, so the child is about to end; one that does not is made to.
  int reap() {
    const auto start = Clock::now();
    int status = 0;
    while (true) {
      const pid_t ended = waitpid(child_.pid, &status, WNOHANG);
      hear();  // one that waits for room in the pipe would not end
      if (ended == child_.pid || (ended < 0 && errno != EINTR)) break;
      if (Clock::now() - start > (stop_ ? kPatience : kGrace)) kill(child_.pid, SIGKILL);
      end_if_late();
      usleep(5000);
    }
    words_.end();
    return status;
  }

 private:
  void end_if_late() {
    if (!deadline_ || Clock::now() < *deadline_) return;
    late_ = true;
    kill(child_.pid, SIGKILL);
  }

  void hear() {
    char bytes[4096];
    for (int turn = 0; turn < 16; ++turn) {  // one that never stops talking is still asked to end
      const ssize_t count = read(child_.words.number(), bytes, sizeof bytes);
      silent_ = count == 0;
      if (count <= 0) return;
      words_.take(bytes, static_cast<std::size_t>(count));
    }
  }

  const Child child_;
  const std::atomic<bool>& stop_;
  const std::optional<Clock::time_point> deadline_;
  JobWords words_;
  bool silent_ = false, late_ = false;
};

/// What the system lacks at the moment is no fault of the raster.
proto::Problem cannot_start(int error) {
  const std::string why = "the process that builds cannot be started: " + std::string(strerror(error));
  if (raster::is_want_of_descriptors(error) || error == ENOMEM || error == EAGAIN)
    return {"service-busy", why, "trying again later", ""};
  return {"job-crashed", why, "posting again later", ""};
}

proto::Problem crashed(int status, bool late) {
  // The clock that the job has set itself has no handler, so that nothing of its libraries can be in the way.
  if (late || (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)) {
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

proto::Result<std::optional<proto::Estimate>> run(const Program& program, const std::filesystem::path& folder,
                                                  const ProgressSink& progress, const std::atomic<bool>& stop) {
  updates::RangeAnswers answers;
  raster::Descriptor asks = progress.rasters != nullptr ? answers.open() : raster::Descriptor();
  if (progress.rasters != nullptr && !asks.is_open()) return cannot_start(errno);
  auto child = spawn(program, folder.string(), asks.number());
  const int failed = errno;
  asks.close();  // the job has it: when that ends, so do its asks
  if (!child) return cannot_start(failed);
  const pid_t pid = child->pid;
  log_debug("job " + folder.filename().string() + " runs as process " + std::to_string(pid));
  ChildReport report{progress, {}, {}, {}};
  ChildWatch watch(std::move(*child), folder, stop);
  try {
    if (progress.rasters != nullptr) answers.begin(*progress.rasters, stop);
    watch.listen_to(report);
  } catch (...) {  // of what its report says, or no thread: the job must not go on behind the back of the next one
    kill(pid, SIGKILL);
    watch.reap();
    throw;
  }
  const int status = watch.reap();
  answers.end();
  std::error_code ignored;
  std::filesystem::remove_all(folder / kTemporaryFolder, ignored);
  if (answers.problem() && !stop) return *answers.problem();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return report.estimate;
  if (stop) return pipeline::kCancelled;
  if (report.problem) return *report.problem;
  return crashed(status, watch.late());
}

/// The folder may be named as it is, from the root or without its links.
std::string without_folder(std::string text, const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& spelt :
       {std::filesystem::weakly_canonical(folder, ignored), std::filesystem::absolute(folder, ignored), folder}) {
    text = proto::without_path(std::move(text), spelt.string() + "/", "");
    text = proto::without_path(std::move(text), spelt.string(), "the job's folder");
  }
  return text;
}

}  // namespace

JobRunner telling_no_places(JobRunner runner) {
  return [runner = std::move(runner)](const std::filesystem::path& folder, const ProgressSink& progress,
                                      const std::atomic<bool>& stop) {
    auto outcome = runner(folder, progress, stop);
    if (outcome) return outcome;
    proto::Problem problem = outcome.problem();
    problem.detail = without_folder(problem.detail, folder);
    problem.accepted = without_folder(problem.accepted, folder);
    const std::string all = outcome.problem().line();
    if (problem.line() != all) log_warning("job " + folder.filename().string() + ": " + all);
    return JobOutcome(problem);
  };
}

JobRunner child_runner(const std::string& program, std::uint32_t free_percent) {
  return
      [program = Program{program, free_percent}](const std::filesystem::path& folder, const ProgressSink& progress,
                                                 const std::atomic<bool>& stop) { return run(program, folder, progress, stop); };
}

}  // namespace cordillera::server
