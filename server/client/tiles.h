#pragma once
// Which addresses of a dataset a command line means. All are relative to the dataset's own address.
#include <string>
#include <vector>

#include "proto/result.h"
#include "server/http/json.h"

namespace cordillera::server::client {

/// "10/617/763.drc" is tiles/10/617/763.drc, "manifest" is manifest.json; what is neither stays as it is. A problem: it could
/// lead elsewhere.
proto::Result<std::string> address_named(const std::string& what);

/// Tiles of a box and of levels, both as the user wrote them.
struct TileWords {
  std::string bbox;    ///< "west,south,east,north"; empty: all of the data
  std::string level;   ///< "10" or "8-10"; empty: all that the dataset has
  std::string format;  ///< drc, glb or terrain
};
/// Every address in the box; where the data has holes or ragged edges some have no tile. A problem: the words, or none of the
/// dataset is in them.
proto::Result<std::vector<std::string>> addresses_of(const Json& manifest, const TileWords& words);

/// The same of terrain for Cesium, which has more tiles than meshes: what the layer.json names, with a tile in the box its three
/// siblings, and both roots.
proto::Result<std::vector<std::string>> addresses_of_layer(const Json& manifest, const Json& layer, const TileWords& words);

/// Addresses of tiles of the finest level, those nearest to the middle of the data first.
proto::Result<std::vector<std::string>> addresses_from_the_middle(const Json& manifest, const std::string& format);

}  // namespace cordillera::server::client
