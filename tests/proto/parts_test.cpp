// What parts a text has, and what ends the walk over them.
#include "proto/parts.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace cordillera::proto {
namespace {

using Texts = std::vector<std::string>;

Texts parts_of(std::string_view text, char separator = ',') {
  Texts parts;
  each_part(text, separator, [&](std::string_view part) { parts.emplace_back(part); });
  return parts;
}

TEST(Parts, AreWhatStandsBetweenSeparators) {
  EXPECT_EQ(parts_of("a"), Texts{"a"});
  EXPECT_EQ(parts_of("a,b c"), (Texts{"a", "b c"}));
  EXPECT_EQ(parts_of(" a, b"), (Texts{" a", " b"})) << "blanks stay";
  EXPECT_EQ(parts_of("/a:/b,c", ':'), (Texts{"/a", "/b,c"}));
}

TEST(Parts, MayBeEmptyButForTheLast) {
  EXPECT_EQ(parts_of(""), Texts{});
  EXPECT_EQ(parts_of(","), Texts{""});
  EXPECT_EQ(parts_of("a,"), Texts{"a"});
  EXPECT_EQ(parts_of(",a,,b,,"), (Texts{"", "a", "", "b", ""}));
}

TEST(Parts, EndWithTheFirstThatIsWanted) {
  int looked_at = 0;
  const auto is_b = [&](std::string_view part) { return ++looked_at > 0 && part == "b"; };
  EXPECT_TRUE(each_part("a,b,c", ',', is_b));
  EXPECT_EQ(looked_at, 2);
  EXPECT_FALSE(each_part("a,c", ',', is_b));
  EXPECT_EQ(looked_at, 4);

  const auto value = [](std::string_view part) { return part.starts_with("x=") ? std::optional(part.substr(2)) : std::nullopt; };
  EXPECT_EQ(each_part("y=1,x=,x=2", ',', value), "") << "a value, though it is empty";
  EXPECT_EQ(each_part("y=1,x=2", ',', value), "2");
  EXPECT_EQ(each_part("", ',', value), std::nullopt);
}

}  // namespace
}  // namespace cordillera::proto
