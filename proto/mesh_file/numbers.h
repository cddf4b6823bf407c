#pragma once
// Numbers as text, the same in every locale.
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace cordillera::proto {

/// The whole word as a number; nothing if it is none or does not fit into T.
template <class T>
std::optional<T> number(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-' && word[1] != '+') word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Appends the fewest digits that read back as the same number.
template <class T>
void append_number(std::string& text, T value) {
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace cordillera::proto
