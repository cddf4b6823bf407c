#pragma once
// Files of this machine of which only some bytes are there. What is missing is asked for before it is read: by whom, is said by
// who opens them.
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace cordillera::raster {

struct ByteRange {
  std::uint64_t first = 0, count = 0;
};

inline constexpr std::uint64_t kRangeBlock_bytes = 64 << 10;  ///< is there or not there as a whole

/// Returns when these bytes are in the file of that number; it does not return without them. Within the file, at most kMostRanges
/// and kMostAsked_bytes together. Called by one thread at a time.
using AskRanges = std::function<void(std::size_t file, std::span<const ByteRange>)>;
inline constexpr std::size_t kMostRanges = 256;
inline constexpr std::uint64_t kMostAsked_bytes = std::uint64_t{8} << 20;

struct RangedFile {
  std::string path;    ///< its size on disk is that of the whole
  std::string name;    ///< what the user called it, without folders: drivers look at that
  std::string state;   ///< of what stands where it comes from, to tell whether that is still the same
  bool whole = false;  ///< all of it is there
};

struct RangedFiles {
  std::vector<RangedFile> files;
  /// The path of a VRT that names them as GDAL is to open them; empty: there is none. GDAL opens what a VRT names with any of its
  /// drivers: from then on it has none but those that anybody's rasters are opened with, and none of the files may be a VRT.
  std::string vrt;
  std::string vrt_state;  ///< of all that it names
  AskRanges ask;
};

/// From here on, in this process, these files are read so, and no others: once a process. False: one cannot be read.
bool read_by_ranges(RangedFiles files);

/// The file that has this path and is not whole; else null.
const RangedFile* ranged_file(const std::string& path);
/// Whether the file is the VRT that names them.
bool is_vrt_of_ranged_files(const std::string& path);
/// Of that VRT.
const std::string& state_of_vrt();
/// What GDAL is to open the file of that number as. Nothing lies beside it. name: the file's.
std::string name_for_gdal(std::size_t file, const std::string& name);
/// file: of ranged_file().
std::string name_for_gdal(const RangedFile& file);

}  // namespace cordillera::raster
