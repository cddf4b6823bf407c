// A machine that has no thread more. Each test is a process of its own: what it is denied, it never gets back.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <future>
#include <string>
#include <system_error>
#include <thread>

#include "server/front/workers.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

/// So few addresses from now on that a thread finds none for its stack, and small things still do.
void allow_no_thread_more() {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  const rlim_t bytes = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + (rlim_t{2} << 20);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

/// 0: a request was answered though the system has no thread more.
int answer_without_another_thread() {
  front::Workers workers(4, 10, 10);
  allow_no_thread_more();
  try {
    std::thread([] {}).join();
    return 2;  // it has: nothing is shown
  } catch (const std::system_error&) {
  }
  std::promise<void> answered;
  if (workers.run("client", [&] { answered.set_value(); }) != front::Workers::Taken::yes) return 1;
  answered.get_future().get();
  return 0;
}

TEST(Want, WhoListensHasAThreadToAnswer) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's addresses cannot be counted";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(answer_without_another_thread()), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace cordillera::server
