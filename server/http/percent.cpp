#include "server/http/percent.h"

#include "proto/letters.h"

namespace cordillera::server {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
}

}  // namespace

std::optional<char> escape_at(std::string_view text, std::size_t at) {
  if (text.size() < 3 || at > text.size() - 3 || text[at] != '%') return std::nullopt;
  const int high = hex_digit(text[at + 1]), low = hex_digit(text[at + 2]);
  if (high < 0 || low < 0) return std::nullopt;
  return static_cast<char>(high * 16 + low);
}

std::string percent_decoded(std::string_view text, AddressPart part) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t at = 0; at < text.size(); ++at) {
    const auto byte = escape_at(text, at);
    if (byte && (*byte != '/' || part == AddressPart::query)) {
      out += *byte;
      at += 2;
    } else {
      out += text[at] == '+' && part == AddressPart::query ? ' ' : text[at];
    }
  }
  return out;
}

std::string percent_encoded(std::string_view text, std::string_view others) {
  const std::string kept = std::string("-._~").append(others);
  return proto::percent_escaped(text, [&](char c) { return proto::is_letter_or_digit(c, kept); });
}

}  // namespace cordillera::server
