#pragma once
// Paths with braces, "tiles/{z}/{x}/{y}.drc": of faces, and of the server's routes.
#include <string_view>

namespace cordillera::pipeline::faces {

/// Whether the path is the pattern with a value in the place of each brace. bool take(name, value): whether the value may stand
/// there; it is asked from left to right. A value ends before the pattern's next letter, or with the path; it may be empty.
template <class Take>
bool matches(std::string_view pattern, std::string_view path, const Take& take) {
  while (!pattern.empty()) {
    if (pattern[0] != '{') {
      if (path.empty() || path[0] != pattern[0]) return false;
      pattern.remove_prefix(1);
      path.remove_prefix(1);
      continue;
    }
    const std::size_t end = pattern.find('}');
    const std::string_view name = pattern.substr(1, end - 1);
    pattern.remove_prefix(end + 1);
    const std::string_view value = path.substr(0, pattern.empty() ? path.size() : path.find(pattern[0]));
    path.remove_prefix(value.size());
    if (!take(name, value)) return false;
  }
  return path.empty();
}

}  // namespace cordillera::pipeline::faces
