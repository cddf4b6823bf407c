#pragma once
// The numbers of a text grid (Esri ASCII), read once for all that opened it. GDAL finds a line by reading all before it, anew for
// each handle, and forgets numbers that its cache has no room for.
#include <gdal_priv.h>

#include <memory>

#include "proto/result.h"
#include "raster/disk/private_folder.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {

inline constexpr const char* kTextGrid = "AAIGrid";  ///< its driver

/// Of one handle, and not thread-safe, as that is.
class TextRows {
 public:
  /// The band to read rows before `end` from: of a text grid its copy, which the first that asks makes and the others wait for;
  /// of other rasters their own. "raster-unreadable": one of the rows is damaged; none behind the first such is ever read.
  proto::Result<GDALRasterBand*> band(const Dataset& dataset, int end);

 private:
  std::shared_ptr<const PrivateFolder> folder_;  ///< of the copy, until it is closed
  GDALDatasetUniquePtr copy_;
  int readable_ = 0;  ///< rows before the first damaged one
};

}  // namespace cordillera::raster
