#include "raster/open/whole_file.h"

#include <cpl_string.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>

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

/// Numbers of a TIFF, in its order of bytes; 0 beyond the file's end.
class TiffNumbers {
 public:
  explicit TiffNumbers(const std::string& path) : file_(path, std::ios::binary) {
    char order[2] = "";
    file_.read(order, 2);
    large_first_ = order[0] == 'M';
    const std::uint64_t version = at(2, 2);
    if (file_ && order[0] == order[1] && (large_first_ || order[0] == 'I') && (version == 42 || version == 43))
      version_ = static_cast<int>(version);
  }
  bool is_tiff() const { return version_ != 0; }
  bool is_big() const { return version_ == 43; }
  std::uint64_t at(std::uint64_t place, int bytes) {
    unsigned char read[8] = {};
    file_.clear();
    if (place > kFarthest || !file_.seekg(static_cast<std::streamoff>(place)) ||
        !file_.read(reinterpret_cast<char*>(read), bytes))
      return 0;
    std::uint64_t value = 0;
    for (int k = 0; k < bytes; ++k) value = value << 8 | read[large_first_ ? k : bytes - 1 - k];
    return value;
  }

 private:
  static constexpr std::uint64_t kFarthest = std::uint64_t{1} << 62;
  std::ifstream file_;
  bool large_first_ = false;
  int version_ = 0;
};

/// Whether a TIFF has more directories in a row than that. GDAL finds the end of a loop.
bool has_more_directories(const std::string& path, std::size_t most) {
  TiffNumbers tiff(path);
  if (!tiff.is_tiff()) return false;
  const int count = tiff.is_big() ? 8 : 2, entry = tiff.is_big() ? 20 : 12, offset = tiff.is_big() ? 8 : 4;
  constexpr std::uint64_t kMostEntries = 65536;
  std::set<std::uint64_t> seen;
  for (std::uint64_t place = tiff.at(tiff.is_big() ? 8 : 4, offset); place != 0 && seen.insert(place).second;) {
    if (seen.size() > most) return true;
    const std::uint64_t entries = tiff.at(place, count);
    if (entries == 0 || entries > kMostEntries) return false;  // damaged: GDAL goes no further
    place = tiff.at(place + static_cast<std::uint64_t>(count) + entries * static_cast<std::uint64_t>(entry), offset);
  }
  return false;
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

proto::Result<void> check_directories(const std::string& path, const std::string& name) {
  constexpr std::size_t kMost = 2000;  // GDAL takes 2 s for as many masks, and four times as long for twice as many
  std::error_code error;
  if (!fs::is_regular_file(path, error) || !has_more_directories(path, kMost)) return {};
  return proto::Problem{"raster-unreadable", name + " has more than " + std::to_string(kMost) + " directories",
                        "a TIFF of at most " + std::to_string(kMost) + " pages, masks and overviews", ""};
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
