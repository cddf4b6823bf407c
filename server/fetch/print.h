#pragma once
// What of a raster at an address is remembered.
#include <cstdint>
#include <optional>
#include <string>

#include "server/http/json.h"

namespace cordillera::server::updates {

/// What a server says of the bytes behind an address, to tell later whether they are still the same. Empty: it does not say.
struct Print {
  std::string etag, modified;
  std::uint64_t bytes = 0;
  bool ranged = false;  ///< what was fetched is the beginning; the rest comes as it is asked for
  bool list = false;    ///< it names other rasters, which were fetched too, or their beginnings
};

/// As it is noted in a dataset's folder.
Json print_json(const Print& print);
/// nullopt: no such note. A job could have written it, and what it says goes into requests: text that no header has is left out.
std::optional<Print> print_in(const Json& note);

}  // namespace cordillera::server::updates
