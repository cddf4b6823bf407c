#pragma once
// Numbers as text, the same in every locale.
#include <charconv>
#include <optional>
#include <string>
#include <string_view>

namespace cordillera::proto {

/// The whole text as a number, to this base where T is an integer. Nothing where it is none, has a "+" or blanks, or does not fit
/// into T.
template <class T, class... Base>
std::optional<T> number(std::string_view text, Base... base) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// The same of a text that people write: it may begin with a "+".
template <class T>
std::optional<T> signed_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return number<T>(text);
}

/// Appends the fewest digits that read back as the same number.
template <class T>
void append_number(std::string& text, T value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace cordillera::proto
