#pragma once
// The tiles of a face that stand in one quadtree, and where archives of square tiles have them.
#include <cstdint>
#include <functional>
#include <string>

#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// The tiles that an archive of a face holds: the first of its resources whose path has z, x and y of a whole grid. Null where it
/// has none.
const faces::Resource* tiles_of(const faces::Face& face);

/// Every path that the face names, and what stands there, in the face's order. visit is called by the caller's thread.
void each_named(const faces::Terrain& terrain, const faces::Face& face, faces::Listing listing,
                const std::function<void(const std::string& path, const faces::Found& found)>& visit);

/// Every place that the face names for these tiles, in the same way. A tile that it names below an implicit root is named by
/// its absolute address.
void each_place(const faces::Terrain& terrain, const faces::Face& face, const faces::Resource& tiles, faces::Listing listing,
                const std::function<void(const faces::Place&)>& visit);

/// An address in a pyramid with one tile at zoom 0 and rows from the north, as PMTiles and web maps count.
struct SquareAddress {
  int zoom = 0;
  std::uint32_t x = 0, y = 0;
  friend auto operator<=>(const SquareAddress&, const SquareAddress&) = default;
};

/// Web Mercator as it is. The two roots of the geodetic grid are the northern half of zoom 1: level z is zoom z + 1, columns as
/// they are, rows from the north. That is OGC's GoogleCRS84Quad.
SquareAddress square_address(faces::Grid grid, const faces::Place& place);
faces::Place place_at(faces::Grid grid, const SquareAddress& address);

/// The registered name of the pyramid that square_address counts in.
const char* square_matrix_set(faces::Grid grid);

}  // namespace cordillera::pipeline::exports
