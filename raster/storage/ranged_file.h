#pragma once
// A file of this machine of which only some bytes are there. What is missing is asked for before it is read: by whom, is said by
// who opens it.
#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace cordillera::raster {

struct ByteRange {
  std::uint64_t first = 0, count = 0;
};

inline constexpr std::uint64_t kRangeBlock_bytes = 64 << 10;  ///< is there or not there as a whole

/// Returns when these bytes are in the file; it does not return without them. Within the file, at most kMostRanges and kMostAsked
/// bytes together. Called by one thread at a time.
using AskRanges = std::function<void(std::span<const ByteRange>)>;
inline constexpr std::size_t kMostRanges = 256;
inline constexpr std::uint64_t kMostAsked_bytes = std::uint64_t{8} << 20;

struct RangedFile {
  std::string path;   ///< its size on disk is that of the whole
  std::string name;   ///< what the user called it, without folders: drivers look at that
  std::string state;  ///< of what stands where it comes from, to tell whether that is still the same
  AskRanges ask;
};

/// From here on, in this process, the file is read so, and no other: one such file a process, once. False: it cannot be opened.
bool read_by_ranges(RangedFile file);

/// The file, if it has this path; else null.
const RangedFile* ranged_file(const std::string& path);
/// What GDAL is to open it as. Nothing lies beside it.
std::string name_for_gdal(const RangedFile& file);

}  // namespace cordillera::raster
