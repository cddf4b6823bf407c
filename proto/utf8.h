#pragma once
// Text of strangers' files. Messages hold UTF-8 or cannot be read again, and many a file names its coordinate system in Latin-1.
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

/// Blanks in place of control characters and of what else ends a line in some program (U+0080 to U+009F, U+2028, U+2029).
/// text: UTF-8.
inline std::string one_line(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const auto at = [&](std::size_t k) { return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u; };
    const bool control = at(0) < 0x20 || at(0) == 0x7f, late = at(0) == 0xc2 && at(1) >= 0x80 && at(1) < 0xa0;
    const bool separator = at(0) == 0xe2 && at(1) == 0x80 && (at(2) == 0xa8 || at(2) == 0xa9);
    if (control || late || separator)
      out += ' ';
    else
      out += text[i];
    i += late ? 2 : separator ? 3 : 1;
  }
  return out;
}

/// What is shown of a text that a stranger's file holds, on one line: it may hold a million letters, and any character.
inline std::string shown_text(std::string_view text, std::size_t most_bytes = kMostShown_bytes) {
  // Four bytes a letter at most, so that what is left out here is left out below too.
  const bool long_one = text.size() > 4 * most_bytes && !is_utf8(text);
  return one_line(cut_text(as_utf8(long_one ? text.substr(0, 4 * most_bytes) : text), most_bytes));
}

}  // namespace cordillera::proto
