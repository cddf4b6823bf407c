#pragma once
// Text of strangers' files. Messages hold UTF-8 or cannot be read again, and many a file names its coordinate system in Latin-1.
#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace cordillera::proto {

/// What editors and spreadsheets write before a text. It is no part of it.
inline constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf";

/// As Unicode has it: shortest forms, no surrogates, nothing beyond U+10FFFF.
inline bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto at = [&](std::size_t k) { return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u; };
    const unsigned lead = at(0), second = at(1);
    const std::size_t more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
    if ((lead >= 0x80 && lead < 0xc2) || lead > 0xf4) return false;
    for (std::size_t k = 1; k <= more; ++k) {
      if ((at(k) & 0xc0) != 0x80) return false;
    }
    if ((lead == 0xe0 && second < 0xa0) || (lead == 0xed && second >= 0xa0)) return false;
    if ((lead == 0xf0 && second < 0x90) || (lead == 0xf4 && second >= 0x90)) return false;
    i += more + 1;
  }
  return true;
}

/// The text; if it is no UTF-8, as it reads in Latin-1.
inline std::string as_utf8(std::string_view text) {
  if (is_utf8(text)) return std::string(text);
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80) out += static_cast<char>(0xc0 | byte >> 6);
    out += static_cast<char>(byte < 0x80 ? byte : 0x80 | (byte & 0x3f));
  }
  return out;
}

/// At most so many bytes of the text, cut between letters, with "…" where something was left out.
inline std::string cut_text(std::string text, std::size_t most_bytes) {
  if (text.size() <= most_bytes) return text;
  std::size_t end = most_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  text.resize(end);
  return text += "…";
}

inline constexpr std::size_t kMostShown_bytes = 240;  ///< of a stranger's text in a message or a document: a line

/// Bytes of the character at the beginning if it is one that no line of text has: what steers a terminal (C0, DEL, U+0080 to
/// U+009F), ends a line in some program (U+2028, U+2029), or turns the order of what stands beside it (U+202A to U+202E, U+2066
/// to U+2069). 0: it is none. text: UTF-8.
inline std::size_t control_bytes(std::string_view text) {
  const auto at = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  if (text.empty()) return 0;
  if (at(0) < 0x20 || at(0) == 0x7f) return 1;
  if (at(0) == 0xc2 && at(1) >= 0x80 && at(1) < 0xa0) return 2;
  if (at(0) != 0xe2) return 0;
  return (at(1) == 0x80 && at(2) >= 0xa8 && at(2) <= 0xae) || (at(1) == 0x81 && at(2) >= 0xa6 && at(2) <= 0xa9) ? 3 : 0;
}

inline bool has_control(std::string_view text) {
  for (; !text.empty(); text.remove_prefix(1)) {
    if (control_bytes(text) > 0) return true;
  }
  return false;
}

/// Another character in place of each of those.
inline std::string without_control(std::string_view text, char instead) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t bytes = control_bytes(text);
    out += bytes > 0 ? instead : text.front();
    text.remove_prefix(std::max<std::size_t>(bytes, 1));
  }
  return out;
}

/// Blanks in place of them.
inline std::string one_line(std::string_view text) { return without_control(text, ' '); }

/// What is shown of a text that a stranger's file holds, on one line: it may hold a million letters, and any character.
inline std::string shown_text(std::string_view text, std::size_t most_bytes = kMostShown_bytes) {
  // Four bytes a letter at most, so that what is left out here is left out below too.
  const bool long_one = text.size() > 4 * most_bytes && !is_utf8(text);
  return one_line(cut_text(as_utf8(long_one ? text.substr(0, 4 * most_bytes) : text), most_bytes));
}

}  // namespace cordillera::proto
