#pragma once
// What a POST of a raster asks for: its options and the way its raster comes, checked before a byte of the body is read.
#include <optional>
#include <string>

#include "server/api/requests/delivery.h"

namespace cordillera::server {

/// A POST whose query and headers are in order.
struct Posting {
  Settings settings;
  std::string name;
  Delivery delivery;
  std::string options_hash;
  bool updates = false;  ///< its rasters can be changed
  bool again = false;    ///< its raster is not kept, for its address has it
  std::string folder;    ///< where the dataset's path begins, as the client sees it
  std::string id;        ///< what the dataset is to be called; empty: a name of its own
};

/// Problems: of options, of what does not go together, and of the delivery.
proto::Result<Posting> read_posting(Service& service, const Request& request, RasterIs raster);

/// Makes it the posting of a form with several rasters, which are kept as those of updates=1 are. A problem: they cannot be.
std::optional<proto::Problem> take_several(const Request& request, Posting& posting);

}  // namespace cordillera::server
