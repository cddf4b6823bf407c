#include "raster/archive/zip_sums.h"

#include <algorithm>
#include <optional>
#include <set>

#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

/// A number of so many bytes, the lowest first.
std::uint64_t number(const std::string& bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t k = count; k-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

/// So many bytes of the file, fewer at its end or where it cannot be read.
std::string bytes_at(const std::string& path, std::uint64_t at, std::uint64_t count) {
  const auto bytes = read_range(path, at, count);
  return bytes.ok() ? (*bytes).value_or("") : "";
}

/// Where the directory begins.
std::optional<std::uint64_t> directory_of(const std::string& zip, std::uint64_t size) {
  constexpr std::size_t kEnd = 22, kLocator = 20, kLongestComment = 65535;
  const std::size_t tail = std::min<std::uint64_t>(size, kEnd + kLongestComment + kLocator);
  const std::string bytes = bytes_at(zip, size - tail, tail);
  const std::size_t end = bytes.rfind("PK\x05\x06");
  if (end == bytes.npos || bytes.size() - end < kEnd) return std::nullopt;
  const std::uint64_t offset = number(bytes, end + 16, 4);
  if (offset != 0xFFFFFFFF) return offset;
  if (end < kLocator || bytes.compare(end - kLocator, 4, "PK\x06\x07") != 0) return std::nullopt;
  const std::string large = bytes_at(zip, number(bytes, end - kLocator + 8, 8), 56);
  return large.size() == 56 && large.starts_with("PK\x06\x06") ? std::optional(number(large, 48, 8)) : std::nullopt;
}

}  // namespace

std::map<std::string, std::uint32_t> sums_of_stored(const std::string& zip) {
  std::map<std::string, std::uint32_t> sums;
  const auto size = size_of(zip);
  const auto directory = size ? directory_of(zip, *size) : std::nullopt;
  if (!directory) return sums;
  // In one piece: entries may be many. What a directory has beyond that is not checked.
  constexpr std::size_t kHead = 46, kMost_bytes = std::size_t{16} << 20;
  const std::string entries = bytes_at(zip, *directory, kMost_bytes);
  std::set<std::string> seen;  // of several entries with one name the first is read
  for (std::size_t at = 0; at + kHead <= entries.size() && entries.compare(at, 4, "PK\x01\x02") == 0;) {
    const std::size_t length = number(entries, at + 28, 2), more = number(entries, at + 30, 2) + number(entries, at + 32, 2);
    if (at + kHead + length > entries.size()) break;
    const std::string name = entries.substr(at + kHead, length);
    const bool stored = number(entries, at + 10, 2) == 0;
    if (seen.insert(name).second && stored) sums[name] = static_cast<std::uint32_t>(number(entries, at + 16, 4));
    at += kHead + length + more;
  }
  return sums;
}

}  // namespace cordillera::raster
