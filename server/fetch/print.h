#pragma once
// What of a raster at an address is remembered.
#include <cstdint>
#include <string>

namespace cordillera::server::updates {

/// What a server says of the bytes behind an address, to tell later whether they are still the same. Empty: it does not say.
struct Print {
  std::string etag, modified;
  std::uint64_t bytes = 0;
  bool ranged = false;  ///< what was fetched is the beginning; the rest comes as it is asked for
};

}  // namespace cordillera::server::updates
