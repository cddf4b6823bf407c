#pragma once
// Room on the disk that holds a folder.
#include <cstdint>
#include <filesystem>
#include <optional>

namespace cordillera::server::limits {

struct DiskSpace {
  std::uint64_t size = 0;  ///< bytes
  std::uint64_t free = 0;  ///< bytes that this user may write
};

/// Nothing where the folder cannot be asked.
std::optional<DiskSpace> disk_space(const std::filesystem::path& folder);

/// Bytes that may be written before less than the share is free; 0: none.
std::uint64_t room(const DiskSpace& disk, std::uint32_t free_percent);

/// What nobody may have of the folder's disk, however empty it is, where such a share stays free.
std::uint64_t bytes_to_leave(const std::filesystem::path& folder, std::uint32_t free_percent);

/// Bytes of a file, or of all in a folder. Of a raster that is fetched as it is read, beside which its map lies, those that are
/// there: most may be missing.
std::uint64_t bytes_on_disk(const std::filesystem::path& file);

}  // namespace cordillera::server::limits
