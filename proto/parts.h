#pragma once
// Lists in a text.
#include <algorithm>
#include <string_view>
#include <type_traits>

namespace cordillera::proto {

/// take(part) for each part of a text between separators, for empty ones too: "a,,b" has three. Behind the last separator there
/// is a part only where there is text, so an empty text has none. If take returns something, the first that is true ends the walk
/// and is returned; where none is, what its type is without a value.
template <class Take>
auto each_part(std::string_view text, char separator, const Take& take) {
  using Found = std::invoke_result_t<const Take&, std::string_view>;
  while (!text.empty()) {
    const std::string_view part = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(text.size(), part.size() + 1));
    if constexpr (std::is_void_v<Found>)
      take(part);
    else if (Found found = take(part))
      return found;
  }
  if constexpr (!std::is_void_v<Found>) return Found();
}

}  // namespace cordillera::proto
