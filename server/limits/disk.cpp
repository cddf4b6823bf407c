#include "server/limits/disk.h"

#include <sys/stat.h>

#include <algorithm>

#include "server/data/layout.h"

namespace cordillera::server::limits {

std::optional<DiskSpace> disk_space(const std::filesystem::path& folder) {
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  if (error) return std::nullopt;
  return DiskSpace{space.capacity, space.available};
}

std::uint64_t room(const DiskSpace& disk, std::uint32_t free_percent) {
  const std::uint64_t kept = disk.size / 100 * free_percent;
  return disk.free > kept ? disk.free - kept : 0;
}

std::uint64_t bytes_to_leave(const std::filesystem::path& folder, std::uint32_t free_percent) {
  const auto disk = disk_space(folder);
  return disk ? disk->size - room({disk->size, disk->size}, free_percent) : 0;
}

std::uint64_t bytes_on_disk(const std::filesystem::path& file) {
  constexpr std::uint64_t kUnit_bytes = 512;
  struct stat found {};
  if (lstat(file.c_str(), &found) != 0) return 0;
  if (S_ISDIR(found.st_mode)) {
    std::uint64_t bytes = 0;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(file, error)) bytes += bytes_on_disk(entry.path());
    return bytes;
  }
  if (!S_ISREG(found.st_mode)) return 0;
  const auto size = static_cast<std::uint64_t>(found.st_size);
  // Blocks are counted late by some file systems, and small where they compress: of a whole file they say nothing.
  std::error_code error;
  const bool has_holes = std::filesystem::exists(map_of(file), error);
  return has_holes ? std::min(size, static_cast<std::uint64_t>(found.st_blocks) * kUnit_bytes) : size;
}

}  // namespace cordillera::server::limits
