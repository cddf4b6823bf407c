#pragma once
// The rasters that a list at a dataset's address names, as they are noted in its folder. They lie beside the note, whole or in
// parts, in kRasters.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "server/fetch/ranged_source.h"

namespace cordillera::server::updates {

inline constexpr std::size_t kMostListed = 2000;  ///< rasters of a list: each is asked for before the first is read

struct ListedRaster {
  std::string address;
  std::string name;  ///< without folders
  proto::BuildOptions options;
  Print print;
};

struct ListedRasters {
  bool vrt = false;  ///< the list is a VRT, which names them by their numbers; else a mosaic of them is built, the first wins
  std::vector<ListedRaster> rasters;
};

/// Where the raster of that number lies, from the folder of all.
std::string file_of(const ListedRasters& listed, std::size_t number);

/// folder: of the rasters. Problem: "storage-full".
proto::Result<void> write_listed(const std::filesystem::path& folder, const ListedRasters& listed);
/// nullopt: there are none, or it is no note of ours.
std::optional<ListedRasters> read_listed(const std::filesystem::path& folder);

/// What tells them from others: it changes with each of their prints.
std::string listed_state(const std::filesystem::path& folder);

/// The address of a raster that a list names: as GDAL writes it ("/vsicurl/https://…", "/vsis3/bucket/key"), or a reference
/// that counts from the list.
std::string listed_address(const std::string& list, const std::string& written);
/// Its name: the last part, without what may be a signature.
std::string listed_name(const std::string& written);

}  // namespace cordillera::server::updates
