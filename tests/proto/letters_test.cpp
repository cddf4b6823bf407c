// ASCII has the letters and digits, and no locale has a say.
#include "proto/letters.h"

#include <gtest/gtest.h>

namespace cordillera::proto {
namespace {

TEST(Letters, AreThoseOfAsciiAlone) {
  int letters = 0, digits = 0, both = 0;
  for (int byte = 0; byte < 256; ++byte) {
    const char c = static_cast<char>(byte);
    letters += is_letter(c);
    digits += is_digit(c);
    both += is_letter_or_digit(c);
  }
  EXPECT_EQ(letters, 52);
  EXPECT_EQ(digits, 10);
  EXPECT_EQ(both, 62);
  for (const char c : {'a', 'z', 'A', 'Z'}) EXPECT_TRUE(is_letter(c)) << c;
  for (const char c : {'0', '9'}) EXPECT_TRUE(is_digit(c)) << c;
  EXPECT_TRUE(is_letter_or_digit('-', ".-_"));
  EXPECT_FALSE(is_letter_or_digit('/', ".-_"));
  EXPECT_FALSE(is_letter_or_digit('\0', ".-_"));
}

TEST(Letters, AreSmallOrCapital) {
  EXPECT_EQ(lower("Ab-Z[\xc4"), "ab-z[\xc4");
  EXPECT_EQ(upper('a'), 'A');
  EXPECT_EQ(upper('z'), 'Z');
  for (const char c : {'A', '`', '{', '1', '\xe4'}) EXPECT_EQ(upper(c), c);
  EXPECT_TRUE(same_letters("EPSG", "epsg"));
  EXPECT_FALSE(same_letters("EPSG", "epsg "));
}

TEST(Letters, StandAlone) {
  EXPECT_EQ(letters_and_digits("NAVD 88 (ft)"), "navd88ft");
  EXPECT_EQ(letters_and_digits(" -\xc3\xa8"), "");
}

TEST(Letters, AreKeptAndOthersEscaped) {
  EXPECT_EQ(percent_escaped("Straße 1.tif", [](char c) { return is_letter_or_digit(c, "."); }), "Stra%C3%9Fe%201.tif");
  EXPECT_EQ(percent_escaped(std::string_view("\0%\xff", 3), [](char) { return false; }), "%00%25%FF");
  EXPECT_EQ(percent_escaped("a%20", [](char) { return true; }), "a%20");
}

TEST(Letters, HaveBlanksAround) {
  EXPECT_EQ(trimmed(" \ta b "), "a b");
  EXPECT_EQ(trimmed(" \t"), "");
  EXPECT_EQ(trimmed(" a\r\n", " \r\n"), "a");
}

}  // namespace
}  // namespace cordillera::proto
