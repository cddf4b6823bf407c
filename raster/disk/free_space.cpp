#include "raster/disk/free_space.h"

#include <atomic>
#include <filesystem>

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

std::atomic<std::uint64_t> kept{0};

std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

}  // namespace

void keep_free(std::uint64_t bytes) { kept = bytes; }

std::optional<proto::Problem> no_room(const std::string& path, std::uint64_t bytes, const std::string& what) {
  const std::uint64_t stays = kept;
  if (stays == 0) return std::nullopt;
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  const auto disk = fs::space(folder.empty() ? fs::path(".") : folder, error);
  if (error || (disk.available >= stays && disk.available - stays >= bytes)) return std::nullopt;
  return proto::Problem{"storage-full",
                        "there is no room for " + what + ": the disk has " + mebibytes(disk.available) + " free, and " +
                            mebibytes(stays) + " of them stay free",
                        "a smaller raster, or trying again when there is room", ""};
}

}  // namespace cordillera::raster
