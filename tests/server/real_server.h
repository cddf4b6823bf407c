#pragma once
// The program as a user runs it: command lines, and `cordillera serve` in a process of its own.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "fixture.h"

namespace cordillera::server {

/// That of the build, or another that is to be as good: deploy.package names the archive's.
inline std::string program_under_test() {
  const char* named = std::getenv("PROGRAM_UNDER_TEST");
  return named == nullptr ? CORDILLERA_PROGRAM : named;
}
inline const std::string kProgram = program_under_test();

struct Ended {
  int code = -1;
  std::string output;  ///< stdout and stderr
};

inline Ended shell(const std::string& command) {
  FILE* pipe = popen(("{ " + command + "; } 2>&1").c_str(), "r");
  Ended ended;
  char bytes[4096];
  for (std::size_t count = 0; (count = fread(bytes, 1, sizeof bytes, pipe)) > 0;) ended.output.append(bytes, count);
  const int status = pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
}

/// The program, with Ctrl-C as soon as it says a line that begins with these words.
inline Ended interrupted_at(const std::string& words, const std::string& command) {
  FILE* pipe = popen(("echo $$; exec " + command + " 2>&1").c_str(), "r");
  Ended ended;
  char line[4096];
  const pid_t process = fgets(line, sizeof line, pipe) != nullptr ? std::atoi(line) : 0;
  while (fgets(line, sizeof line, pipe) != nullptr) {
    ended.output += line;
    if (process > 0 && std::string(line).rfind(words, 0) == 0) kill(process, SIGINT);
  }
  const int status = pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
}

/// In a child, before the program: whatever ends the test ends it too.
inline void end_with_owner() { prctl(PR_SET_PDEATHSIG, SIGKILL); }

/// Ends with its owner.
class RealServer {
 public:
  RealServer() = default;
  RealServer(const RealServer&) = delete;
  RealServer& operator=(const RealServer&) = delete;
  ~RealServer() {
    if (process_ > 0) end(SIGKILL);
  }

  /// On any free port, its data and its log in the folder. Returns when it says where it listens.
  void start(const std::filesystem::path& folder, const std::vector<std::string>& options = {}) {
    log_ = folder / "log";
    std::filesystem::remove(log_);
    std::vector<std::string> words = {kProgram,      "serve", "--listen", "127.0.0.1:0", "--data", (folder / "data").string(),
                                      "--log-level", "debug"};
    words.insert(words.end(), options.begin(), options.end());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    process_ = fork();
    if (process_ == 0) {
      end_with_owner();
      (void)freopen(log_.c_str(), "w", stderr);
      execv(kProgram.c_str(), arguments.data());
      _exit(127);
    }
    base_.clear();
    eventually([&] {
      const bool ended = waitpid(process_, nullptr, WNOHANG) == process_;
      if (ended) process_ = -1;
      const std::string said = log();
      const auto begin = said.find("http://"), end = begin == std::string::npos ? begin : said.find('/', begin + 7);
      if (end != std::string::npos) base_ = said.substr(begin, end - begin);
      return ended || !base_.empty();
    });
    ASSERT_TRUE(process_ > 0 && !base_.empty()) << "the server did not start: " << log();
  }

  void tell(int signal) const {
    if (process_ > 0) kill(process_, signal);
  }
  /// The status that waitpid gives.
  int end(int signal) {
    if (process_ <= 0) return -1;
    kill(process_, signal);
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return status;
  }

  const std::string& base() const { return base_; }  ///< http://127.0.0.1:PORT
  int port() const { return std::atoi(base_.substr(base_.rfind(':') + 1).c_str()); }
  std::string log() const { return file_text(log_); }

  /// The process of the first build, as the log names it; -1 if none begins.
  int child_process() const {
    const std::string words = "runs as process ";
    int process = -1;
    eventually([&] {
      const std::string said = log();
      const auto start = said.rfind(words);  // the last one: a job may have had a second try
      if (start != std::string::npos && said.find('\n', start) != std::string::npos)
        process = std::atoi(&said[start + words.size()]);
      return process > 0;
    });
    return process;
  }

 private:
  std::filesystem::path log_;
  std::string base_;
  pid_t process_ = -1;
};

}  // namespace cordillera::server
