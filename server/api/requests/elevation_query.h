#pragma once
// What an elevation query asks for: places as text of a query, or as JSON of a body.
#include <cstddef>
#include <optional>
#include <vector>

#include "pipeline/encode/strange_json.h"
#include "proto/result.h"
#include "raster/place/geodesic.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Points of one query, given or sampled; and bytes of its body.
inline constexpr std::size_t kMostPlaces = 5000;
inline constexpr std::size_t kMostQueryBytes = std::size_t{1} << 20;
using pipeline::kMostNested;  ///< levels of a body's JSON

struct ElevationQuery {
  std::vector<raster::LinePoint> places;
  bool line = false;         ///< their distances mean something
  std::optional<int> level;  ///< of the meshes; none: the finest
};

/// Reads GET's query, or POST's query and body. Levels between the two given ones are accepted.
proto::Result<ElevationQuery> elevation_query(const Request& request, int least_level, int most_level);

}  // namespace cordillera::server
