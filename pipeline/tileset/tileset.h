#pragma once
// The dataset as 3D Tiles 1.1: an outer root over two implicit quadtrees, W and E, because a template URI counts levels from its
// implicit root and the lattice has two tiles at level 0. Implicit and absolute addresses: z = level, x = x + (E ? 2^level : 0),
// y = y (3D Tiles counts y of regions northward, as the lattice does).
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/encode/json.h"
#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// tileset.json. All URIs are relative to it: tiles/W/{level}/{x}/{y}.glb, subtrees/W/{level}/{x}/{y}.subtree, and E.
/// query: the end of the tiles' URIs, "?normals=texture", or empty. photo: what the orthophoto on the tiles is called, or empty;
/// it stands in the asset's extras as "texture".
std::string tileset_json(const StoreReader& store, std::string_view query = {}, std::string_view photo = {});

/// The error of showing nothing where the data is: what content-less tiles and the outer root say, so that viewers look below
/// them.
double empty_error_m(const proto::Manifest& manifest);

/// What a tileset says of itself: title, attribution, imagery, and credits where CesiumJS looks for them.
Json tileset_asset(const proto::Manifest& manifest);

/// The boundingVolume around both trees: the least region, or, of data that goes over the antimeridian, a sphere. As a region it
/// would be the whole circle, since not all clients take one whose east is less than its west.
Json root_volume(const std::vector<TileExtent>& roots, const proto::Manifest& manifest);

}  // namespace cordillera::pipeline
