// What may stand in a message, and what becomes of other text.
#include "proto/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace cordillera::proto {
namespace {

using namespace std::string_literals;

TEST(Utf8, IsWhatUnicodeAllows) {
  for (const std::string& text :
       {""s, "a\0b"s, "\xc3\xa8"s, "\xe2\x82\xac"s, "\xf0\x9f\x8f\x94"s, "\xed\x9f\xbf"s, "\xf4\x8f\xbf\xbf"s}) {
    EXPECT_TRUE(is_utf8(text)) << text;
    EXPECT_EQ(as_utf8(text), text);
  }
}

TEST(Utf8, OtherBytesAreTakenForLatin1) {
  EXPECT_EQ(as_utf8("Syst\xe8me"), "Système");
  EXPECT_EQ(as_utf8("\x80\xff"), "\xc2\x80\xc3\xbf");
  // Cut short, too long a form, a surrogate, beyond the last letter, a tail without a head.
  for (const std::string& text :
       {"\xc3"s, "a\xe2\x82"s, "\xf0\x9f\x8f"s, "\xc0\x80"s, "\xc1\xbf"s, "\xe0\x9f\xbf"s, "\xf0\x8f\xbf\xbf"s, "\xed\xa0\x80"s,
        "\xf4\x90\x80\x80"s, "\xf5\x80\x80\x80"s, "\xff"s, "\x80"s, "\xc3("s}) {
    EXPECT_FALSE(is_utf8(text));
    EXPECT_TRUE(is_utf8(as_utf8(text)));
  }
}

TEST(Utf8, IsCutBetweenLetters) {
  EXPECT_EQ(cut_text("abc", 3), "abc");
  EXPECT_EQ(cut_text("abcd", 3), "abc…");
  EXPECT_EQ(cut_text("aèè", 4), "aè…") << "the second would be half a letter";
  EXPECT_EQ(cut_text("\xf0\x9f\x8f\x94", 3), "…");
}

TEST(Utf8, IsShownAsALineWhateverAStrangerWrote) {
  EXPECT_EQ(shown_text("furlong"), "furlong");
  for (const std::string& letter : {"x"s, "è"s, "\xf0\x9f\x8f\x94"s, "\xe8"s, "\xff"s}) {
    std::string text;
    for (int k = 0; k < 500000; ++k) text += letter;
    const std::string shown = shown_text(text);
    EXPECT_TRUE(is_utf8(shown));
    EXPECT_LE(shown.size(), kMostShown_bytes + 3);
    EXPECT_GT(shown.size(), kMostShown_bytes - 3);
  }
}

TEST(Utf8, IsShownOnOneLine) {
  EXPECT_EQ(shown_text("a\nb\r\tc\0d\x1b[1m\x7f"s), "a b  c d [1m ");
  EXPECT_EQ(shown_text("a\x85\xe8"), "a è") << "the next line of Latin-1";
  EXPECT_EQ(shown_text("a\xc2\x9f\xe2\x80\xa8\xe2\x80\xa9z"), "a   z");
  EXPECT_EQ(shown_text("\xe2\x80\xaa\xe2\x80\xaex\xe2\x81\xa6\xe2\x81\xa9"), "  x  ") << "what turns the order of letters";
  EXPECT_EQ(shown_text("\xc2\xa0\xe2\x80\xa7è\xe2\x80\xaf\xe2\x81\xa5\xe2\x81\xaa"),
            "\xc2\xa0\xe2\x80\xa7è\xe2\x80\xaf\xe2\x81\xa5\xe2\x81\xaa")
      << "their neighbours stay";
  for (const char* bad :
       {"\x1b", "\x7f", "a\xc2\x80", "\xc2\x9f", "\xe2\x80\xa8", "\xe2\x80\xae", "\xe2\x81\xa6", "\xe2\x81\xa9"})
    EXPECT_TRUE(has_control(bad)) << bad;
  EXPECT_FALSE(has_control("Höhe \xc2\xa0 山 🏔"));
  EXPECT_EQ(shown_text("abcdef", 3), "abc…");
}

}  // namespace
}  // namespace cordillera::proto
