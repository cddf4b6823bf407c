#pragma once
// Text that clients put into a page as it is, and that users wrote.
#include <string>
#include <string_view>

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

}  // namespace cordillera::pipeline
