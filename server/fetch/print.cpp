#include "server/fetch/print.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "raster/disk/descriptor.h"
#include "raster/disk/write_all.h"

namespace cordillera::server::updates {

Json print_json(const Print& print) {
  return {
      {"etag", print.etag}, {"modified", print.modified}, {"bytes", print.bytes}, {"ranged", print.ranged}, {"list", print.list}};
}

std::optional<Print> print_in(const Json& note) try {
  if (!note.is_object()) return std::nullopt;
  const auto plain = [&](const char* key) { return plain_header(note.value(key, "")); };
  return Print{plain("etag"), plain("modified"), note.value("bytes", std::uint64_t{0}), note.value("ranged", false),
               note.value("list", false)};
} catch (const Json::exception&) {  // of other types than we wrote
  return std::nullopt;
}

std::string plain_header(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c > 126; }) ? "" : text;
}

std::optional<std::string> read_note(const std::filesystem::path& file, std::size_t longest) {
  const raster::Descriptor note(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!note.is_open()) return std::nullopt;
  struct stat found {};
  std::string text;
  bool good = fstat(note.number(), &found) == 0 && S_ISREG(found.st_mode) && static_cast<std::size_t>(found.st_size) <= longest;
  if (good) text.resize(static_cast<std::size_t>(found.st_size));
  good = good && raster::read_all_at(note.number(), text, 0);
  return good ? std::optional(std::move(text)) : std::nullopt;
}

}  // namespace cordillera::server::updates
