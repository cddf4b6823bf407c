#pragma once
// The rasters that a list at a dataset's address names: the note of them in its folder, and where each of them lies there, whole
// or in parts.
#include <filesystem>
#include <optional>
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "server/fetch/print.h"

namespace cordillera::server::updates {

inline constexpr int kMostListed = 2000;             ///< rasters of a list: each is asked for before the first is read
inline constexpr std::uint32_t kListSeconds = 60;    ///< to read a list: one may be a table that is computed without an end
inline constexpr std::size_t kLongestListed = 4096;  ///< bytes of a raster's address
inline constexpr std::size_t kMostListed_bytes = std::size_t{8} << 20;  ///< of all of them with their options

/// Where the raster of that number lies, from kRasters.
std::string file_of(const proto::ListedRasters& listed, int number);

/// What is remembered of the raster. Text that no header has is left out: a job could have written the note.
Print print_of(const proto::ListedRaster& raster);
void set_print(const Print& print, proto::ListedRaster& raster);
/// What tells the raster from what stands at its address later.
std::string state_of(const proto::ListedRaster& raster);

/// folder: of the dataset. Problem: "storage-full".
proto::Result<void> write_listed(const std::filesystem::path& folder, const proto::ListedRasters& listed);
/// nullopt: there is none, or it is no note of ours.
std::optional<proto::ListedRasters> read_listed(const std::filesystem::path& folder);

/// The address of a raster that a list names: as GDAL writes it ("/vsicurl/https://…", "/vsis3/bucket/key"), or a reference
/// that counts from the list.
std::string listed_address(const std::string& list, const std::string& written);
/// Its name: the last part, without what may be a signature.
std::string listed_name(const std::string& written);

}  // namespace cordillera::server::updates
