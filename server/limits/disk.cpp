#include "server/limits/disk.h"

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

}  // namespace cordillera::server::limits
