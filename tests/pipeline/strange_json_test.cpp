// JSON that takes more than its length tells.
#include <gtest/gtest.h>

#include <string>

#include "pipeline/encode/strange_json.h"

namespace cordillera::pipeline {
namespace {

std::string object_of(int members) {
  std::string text = "{";
  for (int k = 0; k < members; ++k) text += (k == 0 ? "\"" : ",\"") + std::to_string(k) + "\":" + std::to_string(k);
  return text + "}";
}

std::string list_of(int items, const std::string& item) {
  std::string text = "[" + item;
  for (int k = 1; k < items; ++k) text += "," + item;
  return text + "]";
}

TEST(StrangeJson, HasBoundsOfWhatIsCompared) {
  const Json most = json_of_stranger(object_of(10000));
  ASSERT_EQ(most.size(), 10000u);
  EXPECT_EQ(most["9999"], 9999);
  EXPECT_TRUE(json_of_stranger(object_of(10001)).is_discarded());
  // Together as in one; a member of an inner object is none of the outer one.
  EXPECT_FALSE(json_of_stranger(list_of(4, object_of(5000))).is_discarded());
  EXPECT_TRUE(json_of_stranger(list_of(5, object_of(5000))).is_discarded());
  EXPECT_EQ(json_of_stranger(list_of(30000, R"({"a":{"b":1},"c":2})")).size(), 30000u) << "small ones are as many as one likes";
  EXPECT_EQ(json_of_stranger(R"({"a":{"x":1,"y":2},"b":[{"z":3}]})").dump(), R"({"a":{"x":1,"y":2},"b":[{"z":3}]})");
}

TEST(StrangeJson, HasBoundsOfItsDepth) {
  const auto nested = [](int levels) {
    return std::string(static_cast<std::size_t>(levels), '[') + std::string(static_cast<std::size_t>(levels), ']');
  };
  EXPECT_FALSE(json_of_stranger(nested(kMostNested)).is_discarded());
  EXPECT_TRUE(json_of_stranger(nested(kMostNested + 2)).is_discarded());
  for (const char* text : {"", "{", "{\"a\":}", "[1,]", "}"}) EXPECT_TRUE(json_of_stranger(text).is_discarded()) << text;
}

}  // namespace
}  // namespace cordillera::pipeline
