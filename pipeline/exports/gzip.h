#pragma once
// zlib, as much of it as archives need. The same bytes for the same input and zlib: no time, no name.
#include <cstdint>
#include <string>
#include <string_view>

namespace cordillera::pipeline::exports {

std::string gzip(std::string_view bytes);
std::uint32_t crc32(std::string_view bytes);

}  // namespace cordillera::pipeline::exports
