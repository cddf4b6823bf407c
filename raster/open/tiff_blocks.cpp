#include <cpl_string.h>

#include <filesystem>

#include "proto/numbers.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr std::int64_t kMaxBlocks = std::int64_t{1} << 24;
constexpr std::int64_t kMaxBlock_px = std::int64_t{1} << 28;  // of a block that is far larger than its raster

struct Blocks {
  int columns = 0, rows = 0;
  std::int64_t across = 0, down = 0;
};

Blocks blocks_of(GDALRasterBand& band) {
  Blocks b;
  band.GetBlockSize(&b.columns, &b.rows);
  b.across = (std::int64_t{band.GetXSize()} + b.columns - 1) / b.columns;
  b.down = (std::int64_t{band.GetYSize()} + b.rows - 1) / b.rows;
  return b;
}

std::uint64_t number(GDALRasterBand& band, const char* what, std::int64_t column, std::int64_t row) {
  const char* text =
      band.GetMetadataItem(CPLSPrintf("BLOCK_%s_%d_%d", what, static_cast<int>(column), static_cast<int>(row)), "TIFF");
  return text == nullptr ? 0 : proto::number<std::uint64_t>(text).value_or(0);
}

/// Calls missing(index) for each block without bytes; a Problem when one ends beyond the file.
template <class Missing>
proto::Result<void> check_band(GDALRasterBand& band, const std::string& name, std::uint64_t file_bytes, Missing missing) {
  const Blocks b = blocks_of(band);
  const auto truncated = [&](const std::string& why) {
    return Problem{"raster-truncated", name + " is incomplete or its header is wrong: " + why, "a complete file", ""};
  };
  // GDAL takes memory for a whole block, and where there is enough of it, it takes a minute to fill it.
  if (std::int64_t{b.columns} * b.rows > kMaxBlock_px && (b.columns / 2 > band.GetXSize() || b.rows / 2 > band.GetYSize())) {
    return Problem{"raster-unreadable",
                   name + " is damaged: its header claims blocks of " + std::to_string(b.columns) + " x " +
                       std::to_string(b.rows) + " pixels for a raster of " + std::to_string(band.GetXSize()) + " x " +
                       std::to_string(band.GetYSize()),
                   "a complete, undamaged file", ""};
  }
  // Each block has an entry in an offset table of two bytes or more; a small file that claims millions of blocks lies.
  if (static_cast<std::uint64_t>(b.across * b.down) > file_bytes / 2 + 1)
    return truncated("the header claims " + std::to_string(b.across * b.down) + " blocks in " + std::to_string(file_bytes) +
                     " bytes");
  if (b.across * b.down > kMaxBlocks)
    return Problem{"raster-too-large", name + " has more than 2^24 blocks", "larger tiles or strips", ""};
  for (std::int64_t row = 0; row < b.down; ++row) {
    for (std::int64_t column = 0; column < b.across; ++column) {
      const std::uint64_t offset = number(band, "OFFSET", column, row);
      const std::uint64_t size = number(band, "SIZE", column, row);
      if (offset == 0) {
        missing(row * b.across + column);
      } else if (offset > file_bytes || size > file_bytes - offset) {
        return truncated("block " + std::to_string(column) + ", " + std::to_string(row) + " ends at byte " +
                         std::to_string(offset + size) + " of " + std::to_string(file_bytes));
      }
    }
  }
  return {};
}

}  // namespace

proto::Result<void> check_tiff_blocks(Dataset& dataset) {
  if (dataset.driver != "GTiff") return {};
  std::error_code error;
  const std::uint64_t file_bytes = std::filesystem::file_size(dataset.path, error);
  if (error) return {};  // one of GDAL's own file systems: reading will tell
  const Blocks b = blocks_of(*dataset.band);
  const auto note_missing = [&](std::int64_t index) {
    if (dataset.missing.empty()) dataset.missing.resize(static_cast<std::size_t>(b.across * b.down));
    dataset.missing[static_cast<std::size_t>(index)] = true;
  };
  if (auto checked = check_band(*dataset.band, dataset.name, file_bytes, note_missing); !checked.ok()) return checked;
  dataset.block_columns = b.columns;
  dataset.block_rows = b.rows;
  dataset.blocks_across = static_cast<int>(b.across);
  if (dataset.mask == nullptr) return {};
  return check_band(*dataset.mask, dataset.name, file_bytes, [](std::int64_t) {});
}

}  // namespace cordillera::raster
