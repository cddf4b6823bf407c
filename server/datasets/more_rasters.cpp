#include "server/datasets/more_rasters.h"

#include <cerrno>
#include <cstring>

namespace cordillera::server {

bool MoreRasters::begin(const std::string& name) {
  if (!end()) return false;
  rasters_.push_back({name, "more" + std::to_string(rasters_.size() + 1), "", 0});
  file_ = std::make_unique<raster::NewFile>(folder_ / rasters_.back().file);
  digest_ = std::make_unique<Digest>();
  return written_ = file_->is_open();
}

bool MoreRasters::add(std::string_view bytes) {
  rasters_.back().bytes += bytes.size();
  digest_->add(bytes);
  return written_ = written_ && file_->write(bytes);
}

bool MoreRasters::end() {
  if (!file_) return written_;
  rasters_.back().hash = digest_->finish();
  written_ = written_ && file_->close();
  file_ = nullptr;
  return written_;
}

proto::Result<std::vector<MoreRaster>> MoreRasters::finish() {
  if (!end()) return proto::Problem{"storage-full", "a raster cannot be written to disk: " + std::string(std::strerror(errno)), "", ""};
  for (const MoreRaster& raster : rasters_) {
    if (raster.bytes == 0) return proto::Problem{"body-empty", "the form's file '" + raster.name + "' is empty", "a raster in each file part", "file"};
  }
  return rasters_;
}

}  // namespace cordillera::server
