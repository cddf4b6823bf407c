#include "raster/disk/descriptor.h"

#include <fcntl.h>
#include <gtest/gtest.h>

namespace cordillera::raster {
namespace {

bool is_known(int number) { return fcntl(number, F_GETFD) >= 0; }

Descriptor nothing() { return Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

TEST(ADescriptor, is_closed_once_by_its_last_owner) {
  int number = -1;
  {
    Descriptor first = nothing();
    number = first.number();
    ASSERT_TRUE(first.is_open());
    const Descriptor second = std::move(first);
    EXPECT_FALSE(first.is_open());
    EXPECT_FALSE(first.close());
    EXPECT_TRUE(is_known(number));
  }
  EXPECT_FALSE(is_known(number));
}

TEST(ADescriptor, closes_the_one_before_when_it_gets_another) {
  Descriptor kept = nothing();
  const int before = kept.number();
  Descriptor other = nothing();
  const int now = other.number();
  kept = std::move(other);
  EXPECT_FALSE(is_known(before));
  EXPECT_EQ(kept.number(), now);
  EXPECT_TRUE(kept.close());
  EXPECT_FALSE(is_known(now));
}

TEST(ADescriptor, leaves_errno_to_who_failed) {
  {
    const Descriptor of_nobody(1 << 20);  // closing it fails
    errno = ENOSPC;
  }
  EXPECT_EQ(errno, ENOSPC);
}

}  // namespace
}  // namespace cordillera::raster
