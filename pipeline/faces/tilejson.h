#pragma once
// TileJSON 3.0: what a map client is given to open a face of raster tiles.
#include <functional>
#include <string_view>

#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {

struct RasterTileset {
  std::string_view path;    ///< of the tiles
  std::string_view format;  ///< "png" or "webp"
  std::string_view about;
  std::string_view encoding{};  ///< "mapbox" or "terrarium", as clients know them; empty: a picture
  std::string_view formula{};   ///< of the height, in words of R, G and B
  double rounding_m = 0;        ///< what the encoding adds to a height's error
  double lowest_m = -1e9;       ///< height above the geoid at which the encoding ends
  Json more{};                  ///< further members
};

/// What all of them begin with: names, tiles, zooms and bounds.
Json tilejson_head(const proto::Manifest& manifest, const raster::Area& extent, const Zooms& zooms, std::string_view tiles);
/// Which meshes a zoom is drawn from, and how far its heights may be off. Far from the equator pixels are smaller and need finer
/// levels. more_m: what is added to a level's error; null: nothing.
Json zoom_entry(const proto::Manifest& manifest, const raster::Area& extent, const Zooms& zooms, int zoom,
                const std::function<double(int level)>& more_m = nullptr);
/// The dataset has nothing that Web Mercator shows.
proto::Problem beyond_mercator();

/// Its tile template is relative to the document. A problem where Web Mercator has nothing of the dataset.
proto::Result<std::optional<Document>> tilejson(const Terrain& terrain, const RasterTileset& tiles);

}  // namespace cordillera::pipeline::faces
