#pragma once
// Rasters behind the first one in the same body, each a file beside it; and files that say something of one of them.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/result.h"
#include "raster/disk/new_file.h"
#include "server/http/digest.h"

namespace cordillera::server {

struct MoreRaster {
  std::string name;  ///< as it was sent
  std::string file;  ///< in the upload's folder
  std::string hash;
  std::uint64_t bytes = 0;
};

class MoreRasters {
 public:
  explicit MoreRasters(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// The next one begins; the one before is on disk. False: the disk does not take it.
  bool begin(const std::string& name);
  bool add(std::string_view bytes);
  /// All of them, on disk. Problems: "storage-full", "body-empty".
  proto::Result<std::vector<MoreRaster>> finish();

 private:
  bool end();

  std::filesystem::path folder_;
  std::vector<MoreRaster> rasters_;
  std::unique_ptr<raster::NewFile> file_;
  std::unique_ptr<Digest> digest_;
  bool written_ = true;
};

/// Puts files that describe a raster of the same body (dem.hdr, dem.prj, dem.tfw of dem.tif) into one zip with it, in its place
/// and under its name: what reads rasters takes that for the raster. files: in the order sent; the rasters keep their order.
/// Problems: "storage-full", "body-too-large".
proto::Result<std::vector<MoreRaster>> with_sides_packed(const std::filesystem::path& folder,
                                                         const std::vector<MoreRaster>& files);

}  // namespace cordillera::server
