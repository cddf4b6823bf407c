// Room on a disk that is played: what is announced, what comes, and what other programs do meanwhile.
#include "server/limits/space.h"

#include <gtest/gtest.h>

namespace cordillera::server::limits {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

class DiskOf300MiB : public testing::Test {
 protected:
  std::unique_ptr<Space::Claim> claim(std::uint64_t bytes) { return space_.claim(bytes, &why_); }
  /// Writes as long as it is let; how much that was.
  std::uint64_t write(Space::Claim& claim, std::uint64_t bytes, std::uint64_t piece = kMiB) {
    std::uint64_t written = 0;
    for (; written < bytes; written += piece) {
      why_ = claim.next(piece);
      if (!why_.empty()) break;
      free_ -= piece;
    }
    return written;
  }

  std::uint64_t free_ = 300 * kMiB;
  std::string why_;
  Space space_{[this] { return std::optional(DiskSpace{300 * kMiB, free_}); }, 5};
  static constexpr std::uint64_t kKept = 15 * kMiB;
};

TEST_F(DiskOf300MiB, KeepsItsShareFreeHoweverManyBytesComeUnannounced) {
  const auto first = claim(0), second = claim(0);
  ASSERT_TRUE(first && second);
  std::uint64_t written = 0;
  while (written < 600 * kMiB) {
    const std::uint64_t more = write(*first, kMiB) + write(*second, kMiB);
    if (more == 0) break;
    written += more;
  }
  EXPECT_GE(free_, kKept) << "a chunked body knows no length";
  EXPECT_GT(written, 280 * kMiB) << "and what may be used is used";
  EXPECT_NE(why_.find("kept free"), std::string::npos) << why_;
}

TEST_F(DiskOf300MiB, SetsAsideWhatIsAnnounced) {
  auto announced = claim(200 * kMiB);
  ASSERT_TRUE(announced);
  EXPECT_FALSE(claim(200 * kMiB)) << "both would not fit";
  EXPECT_NE(why_.find("set aside"), std::string::npos) << why_;
  const auto other = claim(0);
  ASSERT_TRUE(other);
  EXPECT_LT(write(*other, 200 * kMiB), 86 * kMiB);
  EXPECT_EQ(write(*announced, 200 * kMiB), 200 * kMiB) << "it was promised";
  EXPECT_GE(free_, kKept);
}

TEST_F(DiskOf300MiB, GetsBackWhatWasNotWritten) {
  {
    const auto announced = claim(200 * kMiB);
    ASSERT_TRUE(announced);
    write(*announced, 10 * kMiB);
    EXPECT_NE(space_.full(100 * kMiB), "");
  }
  EXPECT_EQ(space_.full(250 * kMiB), "");
  EXPECT_NE(space_.full(290 * kMiB), "") << "ten are on the disk";
}

TEST_F(DiskOf300MiB, EndsWhatWasPromisedWhereOthersFilledTheDisk) {
  const auto announced = claim(200 * kMiB);
  ASSERT_TRUE(announced);
  write(*announced, 20 * kMiB);
  free_ = 60 * kMiB;
  EXPECT_LE(write(*announced, 180 * kMiB), (60 + 16) * kMiB - kKept) << "it looks every 16 MiB";
  EXPECT_NE(why_, "");
}

TEST_F(DiskOf300MiB, WhatCanBeMadeAgainGoesFirst) {
  free_ = 40 * kMiB;
  std::uint64_t kept = 100 * kMiB, asked = 0;
  space_.set_spare([&](std::uint64_t bytes) {
    asked = bytes;
    if (kept == 0) return false;
    free_ += kept / 2;
    kept = kept > 2 * kMiB ? kept - kept / 2 : 0;
    return true;
  });
  EXPECT_TRUE(claim(10 * kMiB)) << "there is room";
  EXPECT_EQ(asked, 0u);
  EXPECT_FALSE(space_.claim_for_spare(50 * kMiB, &why_)) << "nothing goes for one of its kind";
  EXPECT_EQ(asked, 0u);
  EXPECT_TRUE(claim(50 * kMiB)) << why_;
  EXPECT_GT(asked, 24 * kMiB);
  EXPECT_EQ(kept, 50 * kMiB) << "no more than is needed";
  EXPECT_EQ(space_.full(100 * kMiB), "");
  EXPECT_FALSE(claim(200 * kMiB)) << "until nothing is left";
  EXPECT_EQ(kept, 0u);
}

TEST(DiskThatCannotBeAsked, RefusesNothing) {
  Space space([] { return std::optional<DiskSpace>(); }, 5);
  std::string why;
  const auto claim = space.claim(std::uint64_t{1} << 60, &why);
  ASSERT_TRUE(claim);
  EXPECT_EQ(claim->next(std::uint64_t{1} << 61), "");
}

}  // namespace
}  // namespace cordillera::server::limits
