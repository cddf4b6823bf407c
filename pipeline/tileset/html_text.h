#pragma once
// Text that clients put into a page as it is, and that users wrote.
#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

namespace cordillera::pipeline {

inline std::string html_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

/// What html_text() made it of; of other people's HTML, its tags as they are.
inline std::string plain_text(std::string_view html) {
  constexpr std::pair<std::string_view, char> kNames[] = {{"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}};
  std::string out;
  while (!html.empty()) {
    const auto* const named =
        std::find_if(std::begin(kNames), std::end(kNames), [&](const auto& n) { return html.starts_with(n.first); });
    const bool found = named != std::end(kNames);
    out += found ? named->second : html.front();
    html.remove_prefix(found ? named->first.size() : 1);
  }
  return out;
}

}  // namespace cordillera::pipeline
