#pragma once
// zlib, as much of it as archives need. The same bytes for the same input and zlib: no time, no name.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace cordillera::pipeline::exports {

inline constexpr int kSmallest = 9, kQuick = 6;  ///< levels of zlib: for files that stay, and while a client waits
std::string gzip(std::string_view bytes, int level = kSmallest);
/// Nothing where it is no whole gzip stream, or holds more than so many bytes.
std::optional<std::string> gunzip(std::string_view bytes, std::size_t most);
std::uint32_t crc32(std::string_view bytes);

}  // namespace cordillera::pipeline::exports
