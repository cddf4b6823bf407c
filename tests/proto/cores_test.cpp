#include "proto/cores.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>

namespace cordillera::proto {
namespace {

/// A thread of its own may run on one core: what it asks for is that one, whatever the machine has.
TEST(Cores, AreThoseThatThisThreadMayRunOn) {
  EXPECT_GE(usable_cores(), 1u);
  unsigned seen = 0;
  std::thread([&] {
    cpu_set_t all, one;
    CPU_ZERO(&all);
    CPU_ZERO(&one);
    ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
    for (int k = 0; k < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++k)
      if (CPU_ISSET(k, &all)) CPU_SET(k, &one);
    ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
    seen = usable_cores();
  }).join();
  EXPECT_EQ(seen, 1u);
}

class Quota : public testing::Test {
 protected:
  Quota() { std::filesystem::create_directories(root_ / "service" / "inner"); }
  ~Quota() override { std::filesystem::remove_all(root_); }

  void put(const std::string& name, const std::string& text) { std::ofstream(root_ / name) << text; }
  unsigned cores() { return quota_cores(root_, root_ / "list"); }

  const std::filesystem::path root_ = testing::TempDir() + "cordillera-quota-" + std::to_string(getpid());
};

TEST_F(Quota, IsTheLeastOfTheGroupAndOfThoseAboveIt) {
  EXPECT_EQ(cores(), 0u);  // nothing is there
  put("list", "4:memory:/elsewhere\n0::/service/inner\n");
  EXPECT_EQ(cores(), 0u);
  put("service/inner/cpu.max", "max 100000\n");
  EXPECT_EQ(cores(), 0u);
  put("service/cpu.max", "250000 100000\n");
  EXPECT_EQ(cores(), 3u);
  put("service/inner/cpu.max", "50000 100000\n");
  EXPECT_EQ(cores(), 1u);
  put("service/inner/cpu.max", "800000 100000\n");
  EXPECT_EQ(cores(), 3u);
}

TEST_F(Quota, OfAContainerStandsAtTheRoot) {
  put("list", "0::/\n");
  put("cpu.max", "200000 100000\n");
  EXPECT_EQ(cores(), 2u);
  put("cpu.max", "nonsense\n");
  EXPECT_EQ(cores(), 0u);
  put("cpu.max", "-1 0\n");
  EXPECT_EQ(cores(), 0u);
}

}  // namespace
}  // namespace cordillera::proto
