#include "server/fetch/print.h"

#include <algorithm>

namespace cordillera::server::updates {

Json print_json(const Print& print) {
  return {
      {"etag", print.etag}, {"modified", print.modified}, {"bytes", print.bytes}, {"ranged", print.ranged}, {"list", print.list}};
}

std::optional<Print> print_in(const Json& note) try {
  if (!note.is_object()) return std::nullopt;
  const auto plain = [&](const char* key) {
    const std::string value = note.value(key, "");
    return std::any_of(value.begin(), value.end(), [](unsigned char c) { return c < ' ' || c > 126; }) ? std::string() : value;
  };
  return Print{plain("etag"), plain("modified"), note.value("bytes", std::uint64_t{0}), note.value("ranged", false),
               note.value("list", false)};
} catch (const Json::exception&) {  // of other types than we wrote
  return std::nullopt;
}

}  // namespace cordillera::server::updates
