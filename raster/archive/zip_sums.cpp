#include "raster/archive/zip_sums.h"

#include <algorithm>
#include <optional>
#include <set>

#include "proto/utf8.h"
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

/// Where a zip lists its entries.
struct Directory {
  std::uint64_t begin = 0, bytes = 0, entries = 0;
};

/// Of the record that lies at the place: the list ends where it begins, as GDAL takes it.
std::optional<Directory> ends_at(std::uint64_t place, std::uint64_t bytes, std::uint64_t entries) {
  if (bytes > place) return std::nullopt;
  return Directory{place - bytes, bytes, entries};
}

/// Sought as GDAL does, so that what is checked is what it reads: the last locator of a ZIP64, or else the last end record.
std::optional<Directory> directory_of(const std::string& zip, std::uint64_t size) {
  constexpr std::size_t kEnd = 22, kLocator = 20, kLarge = 56, kSought = 65535;
  const std::uint64_t tail = std::min<std::uint64_t>(size, kSought);
  const std::string bytes = bytes_at(zip, size - tail, tail);
  const std::size_t locator = bytes.rfind("PK\x06\x07");
  if (locator != bytes.npos && bytes.size() - locator >= kLocator && number(bytes, locator + 4, 4) == 0) {
    const std::uint64_t place = number(bytes, locator + 8, 8);
    const std::string large = bytes_at(zip, place, kLarge);
    if (large.size() == kLarge && large.starts_with("PK\x06\x06"))
      return ends_at(place, number(large, 40, 8), number(large, 24, 8));
  }
  const std::size_t end = bytes.rfind("PK\x05\x06");
  if (end == bytes.npos || bytes.size() - end < kEnd) return std::nullopt;
  return ends_at(size - tail + end, number(bytes, end + 12, 4), number(bytes, end + 8, 2));
}

struct ListedFile {
  std::string name;
  std::uint32_t sum = 0;
  bool stored = false;
};

// In one piece: entries may be many. What a directory has beyond that is not looked at.
constexpr std::uint64_t kMostListBytes = std::uint64_t{16} << 20;

/// How many there are.
template <class See>
std::uint64_t for_each_entry(const std::string& zip, const Directory& directory, const See& see) {
  constexpr std::size_t kHead = 46;
  const std::string entries = bytes_at(zip, directory.begin, std::min(directory.bytes, kMostListBytes));
  std::uint64_t count = 0;
  for (std::size_t at = 0; at + kHead <= entries.size() && entries.compare(at, 4, "PK\x01\x02") == 0;) {
    const std::size_t length = number(entries, at + 28, 2), more = number(entries, at + 30, 2) + number(entries, at + 32, 2);
    if (at + kHead + length > entries.size()) break;
    see(ListedFile{entries.substr(at + kHead, length), static_cast<std::uint32_t>(number(entries, at + 16, 4)),
                   number(entries, at + 10, 2) == 0});
    at += kHead + length + more;
    ++count;
  }
  return count;
}

/// As systems of either kind part folders, and GDAL with them.
constexpr const char* kParts = "/\\";

bool leads_out(const std::string& path) {
  if (path.empty()) return false;
  if (std::string(kParts).find(path.front()) != std::string::npos) return true;
  for (std::size_t at = 0; at <= path.size();) {
    const std::size_t end = std::min(path.find_first_of(kParts, at), path.size());
    if (path.compare(at, end - at, "..") == 0) return true;
    at = end + 1;
  }
  return false;
}

/// Its paths, and those of the folders above them.
class Paths {
 public:
  Paths(const std::string& name, std::size_t most) : name_(name), most_(most) {}
  std::optional<proto::Problem> add(std::string path) {
    constexpr std::size_t kLongest = 4096;
    constexpr std::ptrdiff_t kDeepest = 64;
    if (leads_out(path)) return refused("has a file outside of its own folder: " + proto::shown_text(path, 60));
    const auto folders = std::count_if(path.begin(), path.end(), [](char c) { return c == '/' || c == '\\'; });
    if (path.size() > kLongest || folders > kDeepest)
      return refused("has a path of " + std::to_string(folders) + " folders and " + std::to_string(path.size()) + " bytes");
    const bool folder = path.find_last_of(kParts) + 1 == path.size();
    if (folder) path.pop_back();
    if (!folder && !files_.insert(path).second) return refused("has two files of one name: " + proto::shown_text(path, 60));
    while (all_.insert(path).second) {
      if (all_.size() > most_) return refused("holds more than " + std::to_string(most_) + " files and folders");
      const std::size_t above = path.find_last_of(kParts);
      if (above == path.npos) break;
      path.resize(above);
    }
    return std::nullopt;
  }
  proto::Problem refused(const std::string& why) const {
    return {"archive-unreadable", name_ + " " + why,
            "an archive of at most " + std::to_string(most_) +
                " files and folders, each once, with paths below it of at most 64 folders and 4096 bytes",
            ""};
  }

 private:
  const std::string name_;
  const std::size_t most_;
  std::set<std::string> files_, all_;
};

}  // namespace

std::map<std::string, std::uint32_t> sums_of_stored(const std::string& zip) {
  std::map<std::string, std::uint32_t> sums;
  const auto size = size_of(zip);
  const auto directory = size ? directory_of(zip, *size) : std::nullopt;
  if (!directory) return sums;
  std::set<std::string> seen;  // of several entries with one name the first is read
  for_each_entry(zip, *directory, [&](const ListedFile& entry) {
    if (seen.insert(entry.name).second && entry.stored) sums[entry.name] = entry.sum;
  });
  return sums;
}

proto::Result<void> check_list(const std::string& zip, const std::string& name, std::size_t most) {
  const auto size = size_of(zip);
  const auto directory = size ? directory_of(zip, *size) : std::nullopt;
  if (!directory) return {};
  Paths paths(name, most);
  if (directory->entries > most || directory->bytes > kMostListBytes)
    return paths.refused("holds more than " + std::to_string(most) + " files and folders, or names that are too long");
  std::optional<proto::Problem> problem;
  const std::uint64_t seen = for_each_entry(zip, *directory, [&](const ListedFile& entry) {
    if (!problem) problem = paths.add(entry.name);
  });
  if (problem) return *problem;
  // GDAL goes by their number, and would read on beyond the end of the list.
  if (seen < directory->entries) return paths.refused("has a list of files that ends early");
  return {};
}

}  // namespace cordillera::raster
