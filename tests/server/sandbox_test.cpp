// What a job may still do once it is confined, tried from inside: a process each.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <thread>

#include "fixture.h"
#include "server/sandbox.h"

namespace cordillera::server {
namespace {

class InSandbox : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder_.path() / "job");
    std::filesystem::create_directories(folder_.path() / "other");
    std::ofstream(folder_.path() / "other" / "secret") << "secret";
    std::ofstream(folder_.path() / "job" / "source.tif") << "raster";
  }

  /// What a confined child finds: its exit code. 50: there is no seccomp here; 51: no Landlock, and it was asked for.
  int confined(const std::function<int()>& attempt, bool needs_landlock = false) const {
    const pid_t child = fork();
    if (child == 0) {
      const Confined done = confine({folder_.path() / "job", {}, {}, Gpu::none});
      if (!done.syscalls) _exit(50);
      if (needs_landlock && !done.files) _exit(51);
      _exit(attempt());
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 100 + WTERMSIG(status);
  }
  std::string at(const std::string& name) const { return (folder_.path() / name).string(); }

  TempFolder folder_;
};

#define SKIP_WITHOUT(code)                                                  \
  if (code == 50) GTEST_SKIP() << "this kernel has no seccomp for us";      \
  if (code == 51) GTEST_SKIP() << "this kernel has no Landlock switched on"

int refused(long result) { return result < 0 && (errno == EPERM || errno == EACCES) ? 0 : 1; }

TEST_F(InSandbox, NoSocketsAndNoOtherPrograms) {
  const auto reach = [](int family) { return refused(socket(family, SOCK_STREAM, 0)); };
  const int code = confined([&] { return reach(AF_INET) + 2 * reach(AF_INET6) + 4 * reach(AF_UNIX); });
  SKIP_WITHOUT(code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(confined([] {
              char name[] = "/bin/true";
              char* words[] = {name, nullptr};
              return refused(execv(name, words));
            }), 0);
  EXPECT_EQ(confined([] { return refused(fork()); }), 0);
  EXPECT_EQ(confined([] { return refused(kill(getppid(), 0)) == 0 ? 0 : 7; }), 7) << "a signal is not refused, and the test would not see it if all were";
}

TEST_F(InSandbox, ThreadsAndItsOwnFolderWork) {
  const int code = confined([&] {
    int sum = 0;
    std::thread([&] { sum = 1; }).join();
    std::ofstream(at("job/made")) << "x";
    std::filesystem::rename(at("job/made"), at("job/moved"));
    return sum == 1 && std::filesystem::remove(at("job/moved")) && file_text(at("job/source.tif")) == "raster" ? 0 : 1;
  });
  SKIP_WITHOUT(code);
  EXPECT_EQ(code, 0);
}

TEST_F(InSandbox, OtherDatasetsAreOutOfReach) {
  const int code = confined([&] { return refused(open(at("other/secret").c_str(), O_RDONLY)) + 2 * refused(open(at("other/new").c_str(), O_CREAT | O_WRONLY, 0600)); }, true);
  SKIP_WITHOUT(code);
  EXPECT_EQ(code, 0);
}

}  // namespace
}  // namespace cordillera::server
