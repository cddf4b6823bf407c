#include "raster/open/whole_file.h"

#include <cpl_string.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "raster/open/dataset.h"
#include "raster/open/netcdf_length.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

proto::Result<void> has_bytes(std::uintmax_t bytes, std::uint64_t needed, const std::string& name) {
  if (needed <= bytes) return {};
  return proto::Problem{"raster-truncated",
                        name + " has " + std::to_string(bytes) + " bytes, and its header tells of " + std::to_string(needed),
                        "a complete file", ""};
}

/// Bytes of all pages of an SQLite file, by its header; nothing where that does not tell.
std::optional<std::uint64_t> sqlite_length(const std::string& path) {
  constexpr std::size_t kHeader = 100, kPageSize = 16, kChanged = 24, kPages = 28, kPagesAreOf = 92;
  unsigned char head[kHeader] = {};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(head), kHeader) || std::memcmp(head, "SQLite format 3", 16) != 0) return std::nullopt;
  const auto number = [&](std::size_t at, int bytes) {
    std::uint64_t value = 0;
    for (int k = 0; k < bytes; ++k) value = value << 8 | head[at + static_cast<std::size_t>(k)];
    return value;
  };
  if (number(kChanged, 4) != number(kPagesAreOf, 4))
    return std::nullopt;  // an old SQLite wrote it last, and left the count alone
  const std::uint64_t page = number(kPageSize, 2);
  return number(kPages, 4) * (page == 1 ? 65536 : page);
}

/// Bytes up to the last value of bare rows.
std::optional<std::uint64_t> raw_length(const Dataset& dataset) {
  GDALDataset::RawBinaryLayout layout;
  if (!dataset.handle->GetRawBinaryLayout(layout)) return std::nullopt;
  const auto last = [](int count, GIntBig step) {
    return static_cast<std::uint64_t>(std::max<GIntBig>(step, 0)) * static_cast<std::uint64_t>(std::max(count - 1, 0));
  };
  GDALDataset& raster = *dataset.handle;
  return layout.nImageOffset + last(raster.GetRasterXSize(), layout.nPixelOffset) +
         last(raster.GetRasterYSize(), layout.nLineOffset) + last(raster.GetRasterCount(), layout.nBandOffset) +
         static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(layout.eDataType));
}

/// Of its files the largest is the one of the heights.
std::uintmax_t largest_file(const Dataset& dataset) {
  const CPLStringList files(dataset.handle->GetFileList());
  std::uintmax_t most = 0;
  for (int k = 0; k < files.size(); ++k) {
    std::error_code error;
    const auto bytes = fs::file_size(files[k], error);
    if (!error) most = std::max(most, bytes);
  }
  return most;
}

}  // namespace

proto::Result<void> check_pages(const std::string& path, const std::string& name) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return {};
  const auto bytes = fs::file_size(path, error);
  const auto needed = sqlite_length(path);
  if (error || !needed) return {};
  return has_bytes(bytes, *needed, name);
}

proto::Result<void> check_length(const Dataset& dataset) {
  if (dataset.driver == "netCDF") {
    std::error_code error;
    const auto bytes = fs::file_size(dataset.path, error);
    const auto needed = netcdf_length(dataset.path);
    if (error || !needed) return {};
    return has_bytes(bytes, *needed, dataset.name);
  }
  if (dataset.driver != "EHdr" && dataset.driver != "ERS") return {};
  const std::uintmax_t bytes = largest_file(dataset);
  const auto needed = raw_length(dataset);
  if (bytes == 0 || !needed) return {};
  return has_bytes(bytes, *needed, dataset.name);
}

}  // namespace cordillera::raster
