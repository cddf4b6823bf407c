#pragma once
// ASCII letters and digits, whatever the locale; texts without regard to case, without blanks around them, without all but
// letters and digits; bytes as hexadecimal digits and as escapes.
#include <algorithm>
#include <string>
#include <string_view>

namespace cordillera::proto {

constexpr char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }
constexpr char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
constexpr bool is_letter(char c) { return lower(c) >= 'a' && lower(c) <= 'z'; }

/// Or one of these others.
constexpr bool is_letter_or_digit(char c, std::string_view others = "") {
  return is_letter(c) || is_digit(c) || others.find(c) != others.npos;
}

inline std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = lower(c);
  return out;
}

inline bool same_letters(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

/// Its letters and digits alone, small: "NAVD 88" and "navd88" are one name.
inline std::string letters_and_digits(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (is_letter_or_digit(c)) out += lower(c);
  return out;
}

/// Without the blanks before and behind it. A view of the same text.
inline std::string_view trimmed(std::string_view text, std::string_view blanks = " \t") {
  const auto first = text.find_first_not_of(blanks);
  return first == text.npos ? std::string_view() : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// The bytes as hexadecimal digits in small letters.
template <class Bytes>
std::string hex(const Bytes& bytes) {
  std::string digits;
  for (const unsigned char byte : bytes) {
    digits += "0123456789abcdef"[byte >> 4];
    digits += "0123456789abcdef"[byte & 15];
  }
  return digits;
}

/// Bytes that are not kept as "%C3", the escapes of addresses (RFC 3986, 2.1). keeps: whether a byte stays as it is.
template <class Keeps>
std::string percent_escaped(std::string_view text, const Keeps& keeps) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (keeps(c))
      out += c;
    else
      out += {'%', "0123456789ABCDEF"[byte >> 4], "0123456789ABCDEF"[byte & 15]};
  }
  return out;
}

}  // namespace cordillera::proto
