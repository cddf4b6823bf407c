#pragma once
// What of a raster at an address is remembered.
#include <cstdint>
#include <filesystem>
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
/// nullopt: no such note. A job could have written it, and what it says goes into requests.
std::optional<Print> print_in(const Json& note);
/// The text, or nothing where no header has such text.
std::string plain_header(const std::string& text);

/// What stands in a note of ours; nullopt: there is none, or a longer one. A job could have written it: no link is followed.
std::optional<std::string> read_note(const std::filesystem::path& file, std::size_t longest);

}  // namespace cordillera::server::updates
