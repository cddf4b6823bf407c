#pragma once
// A VRT whose rasters are elsewhere: which they are, and the same VRT with other names for them.
// https://gdal.org/drivers/raster/vrt.html
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "proto/result.h"

namespace cordillera::raster {

struct VrtRasters {
  std::vector<std::string> written;  ///< as they stand in it, each once, in the order in which they come first
  std::string text;                  ///< the VRT with the other names, and with overviews
};

/// text: a stranger's. called: what the k-th of the rasters is called in the new text. Taken are VRTs of parts of rasters, as
/// gdalbuildvrt and gdal_translate make them. Problem: "raster-format-unsupported", of one that is warped, computed or raw,
/// or names another VRT; "raster-unreadable". name: for these.
proto::Result<VrtRasters> take_rasters(const std::string& text, const std::string& name,
                                       const std::function<std::string(std::size_t k, const std::string& written)>& called);

/// The refusal of a VRT that names another one. take_rasters knows that one by its suffix alone; who has its bytes knows better.
proto::Problem vrt_in_vrt(const std::string& name, const std::string& other);

}  // namespace cordillera::raster
