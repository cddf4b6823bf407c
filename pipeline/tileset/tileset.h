#pragma once
// The dataset as 3D Tiles 1.1: an outer root over two implicit quadtrees, W and E, because a template URI counts levels from its
// implicit root and the lattice has two tiles at level 0. Implicit and absolute addresses: z = level, x = x + (E ? 2^level : 0),
// y = y (3D Tiles counts y of regions northward, as the lattice does).
#include <array>
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

/// What viewers refine by: a tile's stated error, or that of showing nothing where it does, or where its level shows less than
/// half of the data (levels_shown.h). Else they would stay with the few triangles that a level has of a narrow strip, which are
/// not far off. Borrows the manifest for its constructor alone.
class RefineErrors {
 public:
  explicit RefineErrors(const proto::Manifest& manifest);
  bool stands_for_data(const TileExtent& node) const { return node.content && node.tile.z > last_sparse_; }
  double of(const TileExtent& node) const { return stands_for_data(node) ? node.geometric_error_m : empty_m_; }
  double empty_m() const { return empty_m_; }

 private:
  double empty_m_;
  int last_sparse_;
};

/// The region of the implicit root 'W' or 'E' between two heights. Clients cut it into quarters until they have read a subtree,
/// so it is the whole hemisphere and not the data's own extent: quarters of that would lie elsewhere, and a client would cull
/// subtrees that it should fetch. It is less by what sums of its parts may be off: a last digit beyond a pole is an error to
/// validators.
std::array<double, 6> hemisphere_region(char hemisphere, double low_m, double high_m);

/// What a tileset says of itself: title, attribution, imagery, and credits where CesiumJS looks for them.
Json tileset_asset(const proto::Manifest& manifest);

/// The boundingVolume around both trees: the least region, or, of data that goes over the antimeridian, a sphere. As a region it
/// would be the whole circle, since not all clients take one whose east is less than its west.
Json root_volume(const std::vector<TileExtent>& roots, const proto::Manifest& manifest);

}  // namespace cordillera::pipeline
