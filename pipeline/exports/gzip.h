#pragma once
// zlib, as much of it as archives need. The same bytes for the same input and zlib: no time, no name.
#include <cstdint>
#include <string>
#include <string_view>

namespace cordillera::pipeline::exports {

inline constexpr int kSmallest = 9, kQuick = 6;  ///< levels of zlib: for files that stay, and while a client waits
std::string gzip(std::string_view bytes, int level = kSmallest);
std::uint32_t crc32(std::string_view bytes);

}  // namespace cordillera::pipeline::exports
