#pragma once
// What archives of tiles say of themselves.
#include <initializer_list>
#include <string>

#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::exports {

/// Degrees, west below east: over the antimeridian, all longitudes.
struct Extent {
  double west = -180, south = -90, east = 180, north = 90;
};
/// Of the data as far as tiles of the grid reach: Web Mercator ends before the poles.
Extent extent_of(const proto::Manifest& manifest, faces::Grid grid);

/// "-180,-90,180,90": how archives write boxes and places.
std::string with_commas(std::initializer_list<double> values);

/// Where a client that trusts the archive begins: the middle of the data, and the zoom at which that is about two tiles of a
/// square pyramid wide or high.
struct View {
  double longitude_deg = 0, latitude_deg = 0;
  int zoom = 0;
};
View view_of(const proto::Manifest& manifest, faces::Grid grid, int least, int most);

/// The title where the dataset has one, else its name.
std::string title_of(const proto::Manifest& manifest);

/// How heights are written into the pixels, as the face's own description says ("mapbox", "terrarium"); empty where it says
/// nothing.
std::string pixel_encoding(const faces::Terrain& terrain, const faces::Face& face);

/// What a client is told of layers of vector tiles, as TileJSON has it, with the zooms that the archive has; an empty list for
/// other tiles.
Json vector_layers(const faces::Terrain& terrain, const faces::Face& face, int least, int most);

/// How readers know a format: "pbf" for vector tiles, as the specification of MBTiles has it; the ending of their paths for
/// others.
std::string format_name(const faces::Resource& tiles);
/// "overlay" for what a map lies under, "baselayer" for the rest.
std::string layer_type(const faces::Resource& tiles);

/// The JSON of a PMTiles archive from one zoom to another: title, attribution, which tiles these are, how their addresses count,
/// and the whole manifest.
std::string archive_metadata(const faces::Terrain& terrain, const faces::Face& face, int least, int most);

}  // namespace cordillera::pipeline::exports
