// A job that was taken over, in the sandbox of a real one: it is started as the service starts its jobs, as root and as a plain
// user, on kernels of several ages, and tries whatever probe.h names. What it may do is in job_calls.tsv and nowhere else.
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <map>

#include "../fixture.h"
#include "probe.h"
#include "raster/datum/geoid.h"
#include "server/jobs/child.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

enum class User { root, plain };
constexpr uid_t kNobody = 65534;

struct Findings {
  std::map<std::string, std::string> attacks, works;
  std::map<int, std::string> calls;
  bool ended = false;
};

Findings read_findings(const fs::path& file) {
  Findings findings;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind, answer;
    words >> kind;
    const std::string rest = line.substr(std::min(line.size(), kind.size() + 1));
    if (kind == "attack") {
      const auto cut = std::min(rest.rfind(" refused ("), rest.rfind(" done ("));  // one of them is npos
      findings.attacks[rest.substr(0, cut)] = rest.substr(cut + 1);
    } else if (kind == "work") {
      findings.works[rest.substr(0, rest.rfind(' '))] = rest.substr(rest.rfind(' ') + 1);
    } else if (kind == "call") {
      int number = 0;
      words >> number >> answer;
      findings.calls[number] = answer;
    }
    findings.ended = kind == "end";
  }
  return findings;
}

class TakenOver : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* folder : {"bin", "share", "grids", "data/job", "data/other"}) fs::create_directories(at(folder));
    // Where every user may run it, and with a grid that belongs to the very user: only the sandbox keeps a job from it.
    fs::copy_file(CORDILLERA_PROBE, at("bin/probe"));
    fs::copy_file(raster::egm96_path(), at("share/egm96-15.pgm"));
    std::ofstream(at("grids/grid")) << "grid";
    std::ofstream(at("data/other/victim")) << "victim";
    std::ofstream(at("data/other/second")) << "second";
    std::ofstream(at("data/job/source")) << "raster";
    setxattr(at("data/other/victim").c_str(), "user.kept", "x", 1, 0);
    proto::Job job;
    job.set_id("job"), job.set_name("source"), job.set_raster("source"), job.set_max_seconds(600);
    job.mutable_options()->set_threads(1);
    job.mutable_options()->set_device("cpu");
    std::ofstream(at("data/job") / kJobFile) << to_json_line(job) << '\n';
    setenv("AWS_SECRET_ACCESS_KEY", "secret", 1);
    setenv("CORDILLERA_GEOIDS", at("grids").c_str(), 1);
  }
  fs::path at(const std::string& name) const { return folder_.path() / name; }

  void order(int abi, bool gpu) const {
    std::ofstream(at("data/job") / probe::kOrders) << abi << ' ' << gpu << ' ' << at("data/other").string() << ' '
                                                   << at("grids").string() << ' ' << at("share/egm96-15.pgm").string() << '\n';
  }

  /// Does the work in a process of the user's. False: it did not come to its end.
  bool as(User user, const std::function<void()>& work) const {
    const pid_t child = fork();
    if (child == 0) {
      const bool changes = user == User::plain && geteuid() == 0;
      if (changes) {
        for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) lchown(entry.path().c_str(), kNobody, kNobody);
        chown(folder_.path().c_str(), kNobody, kNobody);
        if (setgroups(0, nullptr) != 0 || setgid(kNobody) != 0 || setuid(kNobody) != 0) _exit(1);
      }
      work();
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

  /// What the probe found as a job. Its end by itself is what a raster that cannot be opened has.
  Findings findings(User user) const {
    const bool done = as(user, [this] {
      const std::atomic<bool> never{false};
      const auto outcome = child_runner(at("bin/probe").string())(at("data/job"), nullptr, never);
      std::ofstream(at("data/outcome")) << (outcome ? "" : outcome.problem().line());
    });
    EXPECT_TRUE(done);
    EXPECT_THAT(file_text(at("data/outcome")), testing::HasSubstr("source"));
    return read_findings(at("data/job") / probe::kFindings);
  }

  /// Content, mode and times of what no job may change.
  std::string untouchable() const {
    std::ostringstream text;
    for (const char* name : {"data/other/victim", "data/other/second", "grids/grid", "share/egm96-15.pgm"}) {
      struct stat now {};
      if (stat(at(name).c_str(), &now) != 0) text << name << " is gone\n";
      text << name << ' ' << now.st_mode << ' ' << now.st_mtim.tv_sec << '.' << now.st_mtim.tv_nsec << ' '
           << std::hash<std::string>{}(file_text(at(name))) << '\n';
      text << listxattr(at(name).c_str(), nullptr, 0) << '\n';
    }
    return text.str();
  }

  TempFolder folder_;
};

// --- the table ---

struct Row {
  std::string name, job, gpu_job, why;
};

/// By number; a row may stand for a range of them.
std::map<int, Row> table() {
  std::map<int, Row> rows;
  std::ifstream file(CORDILLERA_SOURCE_DIR "/tests/server/sandbox/job_calls.tsv");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    std::string numbers;
    Row row;
    for (std::string* cell : {&numbers, &row.name, &row.job, &row.gpu_job, &row.why}) std::getline(cells, *cell, '\t');
    const auto dash = numbers.find('-');
    const int first = std::stoi(numbers), last = dash == numbers.npos ? first : std::stoi(numbers.substr(dash + 1));
    for (int number = first; number <= last; ++number) EXPECT_TRUE(rows.emplace(number, row).second) << "twice: " << number;
    EXPECT_NE(row.why, "") << line;
  }
  return rows;
}

/// "filtered": by its arguments, and those of the probe are none that pass.
std::string seen(const std::string& answer) { return answer == "filtered" ? "EPERM" : answer; }

#ifdef __x86_64__
void expect_the_table(const std::map<int, std::string>& calls, bool gpu) {
  for (const auto& [number, row] : table()) {
    if (number == SYS_exit_group || row.job == "-") continue;  // the probe has ended by itself
    const auto found = calls.find(number);
    ASSERT_NE(found, calls.end()) << number;
    EXPECT_EQ(found->second, seen(gpu ? row.gpu_job : row.job)) << number << ' ' << row.name;
  }
}
#else
void expect_the_table(const std::map<int, std::string>&, bool) {}  // numbers of x86-64
#endif

struct Case {
  const char* name;
  User user;
  int landlock_abi;
  bool gpu;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class Sandboxed : public TakenOver, public testing::WithParamInterface<Case> {};

TEST_P(Sandboxed, TriesEverything) {
  const Case& now = GetParam();
  if (now.user == User::root && geteuid() != 0) GTEST_SKIP() << "not root";
  if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 1) GTEST_SKIP() << "this kernel has no Landlock switched on";
  order(now.landlock_abi, now.gpu);
  const std::string before = untouchable();
  const Findings found = findings(now.user);
  ASSERT_TRUE(found.ended) << "the probe ended early, after " << found.calls.size() << " calls";
  for (const auto& [name, answer] : found.attacks) EXPECT_THAT(answer, testing::StartsWith("refused")) << name;
  EXPECT_GE(found.attacks.size(), 90u);
  for (const auto& [name, answer] : found.works) EXPECT_EQ(answer, "yes") << name;
  EXPECT_EQ(found.works.size(), 10u);
  EXPECT_EQ(untouchable(), before);
  EXPECT_FALSE(fs::exists(at("data/job") / kTemporaryFolder)) << "links are left that the service could follow";
  for (const auto& entry : fs::recursive_directory_iterator(at("data/job")))
    EXPECT_TRUE(fs::is_regular_file(entry.symlink_status()) || fs::is_directory(entry.symlink_status())) << entry.path();
  expect_the_table(found.calls, now.gpu);
}

INSTANTIATE_TEST_SUITE_P(Kernels, Sandboxed,
                         testing::Values(Case{"RootAbi1", User::root, 1, false}, Case{"RootAbi2", User::root, 2, false},
                                         Case{"Root", User::root, 0, false}, Case{"PlainAbi1", User::plain, 1, false},
                                         Case{"PlainAbi2", User::plain, 2, false}, Case{"Plain", User::plain, 0, false},
                                         Case{"GpuRoot", User::root, 0, true}, Case{"GpuPlainAbi2", User::plain, 2, true}),
                         [](const auto& one) { return std::string(one.param.name); });

/// As where the data lie in /opt: what is beside them stays readable, and they do not become so.
TEST_F(TakenOver, ReadsNoOtherDatasetWhereTheDataLieInAFolderThatJobsMayRead) {
  if (syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 1) GTEST_SKIP() << "this kernel has no Landlock switched on";
  const TempFolder beside;
  std::ofstream(beside.path() / "grid") << "grid";
  fs::permissions(beside.path(), fs::perms::owner_all | fs::perms::group_all | fs::perms::others_all);
  ASSERT_EQ(beside.path().parent_path(), folder_.path().parent_path());
  setenv("CORDILLERA_GEOIDS", folder_.path().parent_path().c_str(), 1);
  std::ofstream(at("data/job") / probe::kOrders)
      << "0 0 " << at("data/other").string() << ' ' << beside.path().string() << ' ' << at("share/egm96-15.pgm").string() << '\n';
  const Findings found = findings(User::plain);
  ASSERT_TRUE(found.ended);
  for (const char* name : {"read another dataset", "the folder of datasets", "write another dataset"}) {
    ASSERT_TRUE(found.attacks.contains(name)) << name;
    EXPECT_THAT(found.attacks.at(name), testing::StartsWith("refused")) << name;
  }
  ASSERT_TRUE(found.works.contains("read a grid"));
  EXPECT_EQ(found.works.at("read a grid"), "yes") << "beside the data";
}

/// The same tries by a process without a sandbox: that they are refused is no property of the tries.
TEST_F(TakenOver, IsWhatTheSandboxIsFor) {
  order(0, false);
  fs::create_directories(at("data/job/tmp"));
  ASSERT_TRUE(as(User::plain, [this] { execl(at("bin/probe").c_str(), "probe", "free", at("data/job").c_str(), nullptr); }));
  const Findings found = read_findings(at("data/job") / probe::kFindings);
  ASSERT_TRUE(found.ended);
  for (const char* name :
       {"read another dataset", "truncate(2) another dataset", "change another dataset's times by utimensat",
        "change another dataset's mode by chmod", "empty a grid by a descriptor that reads",
        "change a grid's mode by its descriptor", "write the EGM96 grid", "move the EGM96 grid away",
        "a symbolic link in the folder", "a hard link to another dataset", "a symbolic link moved out of the temporary folder",
        "a program that runs as its owner", "/etc/passwd", "delete another dataset", "the operator's secrets"}) {
    ASSERT_TRUE(found.attacks.contains(name)) << name;
    EXPECT_THAT(found.attacks.at(name), testing::StartsWith("done")) << name;
  }
}

}  // namespace
}  // namespace cordillera::server
