// Bad input is a value: what a Result holds, and what it refuses to give.
#include "proto/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace cordillera::proto {
namespace {

const Problem kWrong{"option-invalid", "error is -3", "a number above 0", "error"};

Result<int> positive(int number) {
  if (number <= 0) return kWrong;
  return number;
}
Result<void> check(int number) {
  if (number <= 0) return kWrong;
  return {};
}

TEST(Result, HoldsAValue) {
  Result<int> three = positive(3);
  ASSERT_TRUE(three.ok());
  EXPECT_TRUE(static_cast<bool>(three));
  EXPECT_EQ(*three, 3);
  *three = 4;
  EXPECT_EQ(three.value(), 4);
  EXPECT_EQ(positive(5).value(), 5);
}

TEST(Result, OrTheProblemThatKeptUsFromOne) {
  const Result<int> none = positive(-3);
  ASSERT_FALSE(none.ok());
  EXPECT_FALSE(static_cast<bool>(none));
  EXPECT_EQ(none.problem().type, "option-invalid");
  EXPECT_EQ(none.problem().parameter, "error");
}

TEST(Result, RefusesWhatItDoesNotHold) {
  EXPECT_THROW((void)positive(-3).value(), std::bad_variant_access);
  EXPECT_THROW((void)positive(3).problem(), std::bad_variant_access);
}

TEST(Result, OfNothingIsGoodUntilAProblemComes) {
  EXPECT_TRUE(check(1).ok());
  EXPECT_TRUE(static_cast<bool>(check(1)));
  ASSERT_FALSE(check(0).ok());
  EXPECT_FALSE(static_cast<bool>(check(0)));
  EXPECT_EQ(check(0).problem().detail, "error is -3");
}

TEST(Result, HandsOnWhatCannotBeCopied) {
  Result<std::unique_ptr<std::string>> made = std::make_unique<std::string>("tile");
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made->get()->size(), 4u);
  const std::unique_ptr<std::string> taken = std::move(made).value();
  EXPECT_EQ(*taken, "tile");
  EXPECT_EQ(*made, nullptr);
}

TEST(Result, TellsAStringFromAProblem) {
  const Result<std::string> text = std::string("all is well");
  EXPECT_TRUE(text.ok());
  EXPECT_EQ(text->substr(0, 3), "all");
  const Result<std::string> none = Problem{"internal", "all is not well", "", ""};
  EXPECT_FALSE(none.ok());
}

TEST(Problem, IsOneLine) {
  EXPECT_EQ(kWrong.line(), "error is -3; accepted: a number above 0");
  EXPECT_EQ((Problem{"internal", "it broke", "", ""}.line()), "it broke");
}

}  // namespace
}  // namespace cordillera::proto
