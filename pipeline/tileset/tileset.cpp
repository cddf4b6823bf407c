#include "pipeline/tileset/tileset.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/encode/json.h"
#include "pipeline/store/levels_shown.h"
#include "pipeline/tileset/html_text.h"
#include "pipeline/tileset/subtree.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPole = kPi / 2 - 1e-14, kAntimeridian = kPi - 1e-14;

// What the property tables of the subtrees hold. Implied regions and errors (a quarter and a half of the parent's) would be
// untrue.
Json schema() {
  return {{"id", "cordillera"},
          {"classes",
           {{"tile",
             {{"properties",
               {{"region",
                 {{"description", "Contains all triangles of the tile and of those below it"},
                  {"semantic", "TILE_BOUNDING_REGION"},
                  {"type", "SCALAR"},
                  {"componentType", "FLOAT64"},
                  {"array", true},
                  {"count", 6},
                  {"required", true}}},
                {"geometric_error",
                 {{"description", "Stated maximum error in metres; for tiles without content the error of showing nothing"},
                  {"semantic", "TILE_GEOMETRIC_ERROR"},
                  {"type", "SCALAR"},
                  {"componentType", "FLOAT64"},
                  {"required", true}}}}}}}}}};
}

Json implicit_root(const TileExtent& node, const proto::Manifest& manifest, std::string_view query) {
  const std::string side = node.tile.x == 0 ? "W" : "E";
  Json tile;
  tile["boundingVolume"] = {{"region", hemisphere_region(side[0], node.region[4], node.region[5])}};
  tile["geometricError"] = RefineErrors(manifest).of(node);
  tile["refine"] = "REPLACE";
  tile["content"] = {{"uri", ("tiles/" + side + "/{level}/{x}/{y}.glb").append(query)}};
  tile["implicitTiling"] = {{"subdivisionScheme", "QUADTREE"},
                            {"subtreeLevels", kSubtreeLevels},
                            {"availableLevels", manifest.max_level() + 1},
                            {"subtrees", {{"uri", "subtrees/" + side + "/{level}/{x}/{y}.subtree"}}}};
  return tile;
}

std::array<double, 6> joined(const std::array<double, 6>& a, const std::array<double, 6>& b) {
  return {std::min(a[0], b[0]), std::min(a[1], b[1]), std::max(a[2], b[2]),
          std::max(a[3], b[3]), std::min(a[4], b[4]), std::max(a[5], b[5])};
}

/// Its east may be beyond the antimeridian.
std::array<double, 4> sphere_around(const std::array<double, 6>& region) {
  constexpr proto::Lattice kFine{20};
  const auto [west, south, east, north, lowest, highest] = region;
  const auto at = [&](double longitude, double latitude, double height_m) {
    const auto column = std::llround(longitude / (2 * kPi) * static_cast<double>(kFine.columns())) + kFine.columns() / 2,
               row = std::llround((latitude / kPi + 0.5) * static_cast<double>(kFine.rows()));
    return proto::ecef(proto::row_frame(kFine, row), proto::column_frame(kFine, column), height_m);
  };
  const proto::Vec3 centre = at((west + east) / 2, (south + north) / 2, (lowest + highest) / 2);
  double radius_m = 0;
  constexpr int kPlaces = 16;  // a side
  for (int i = 0; i <= kPlaces; ++i) {
    for (int k = 0; k <= kPlaces; ++k) {
      for (const double height_m : {lowest, highest}) {
        const double longitude = west + (east - west) * i / kPlaces, latitude = south + (north - south) * k / kPlaces;
        radius_m = std::max(radius_m, proto::length(at(longitude, latitude, height_m) - centre));
      }
    }
  }
  constexpr double kBetween = 1.01, kRounded_m = 100;  // of the places and of the fine lattice
  return {std::round(centre.x), std::round(centre.y), std::round(centre.z), std::ceil(kBetween * radius_m + kRounded_m)};
}

}  // namespace

Json tileset_asset(const proto::Manifest& manifest) {
  Json out = {{"version", "1.1"}, {"tilesetVersion", manifest.id()}, {"generator", "Cordillera"}};
  Json extras = {{"title", manifest.title().empty() ? manifest.name() : manifest.title()}};
  if (!manifest.attribution().empty()) {
    out["copyright"] = manifest.attribution();
    extras["attribution"] = manifest.attribution();
    // Where CesiumJS looks for what it has to show.
    extras["cesium"] = {{"credits", Json::array({{{"html", html_text(manifest.attribution())}, {"showOnScreen", true}}})}};
  }
  if (!manifest.options().imagery().empty()) extras["imagery"] = manifest.options().imagery();
  if (manifest.provisional()) extras["provisional"] = true;  // its geometric errors say when to refine, not how far it is off
  out["extras"] = extras;
  return out;
}

Json root_volume(const std::vector<TileExtent>& roots, const proto::Manifest& manifest) {
  std::array<double, 6> all{};
  const auto& bounds = manifest.bounds();
  const bool wraps = roots.size() == 2 && bounds.size() >= 4 && bounds[0] > bounds[2];
  for (const TileExtent& root : roots) {
    std::array<double, 6> region = root.region;
    if (wraps && root.tile.x == 0) region[0] += 2 * kPi, region[2] += 2 * kPi;
    all = &root == &roots.front() ? region : joined(all, region);
  }
  return wraps ? Json{{"sphere", sphere_around(all)}} : Json{{"region", all}};
}

double empty_error_m(const proto::Manifest& manifest) {
  // Heights apart, what is missing is as large as the data itself. Twice the greatest stated error keeps it above every tile's.
  const auto& b = manifest.bounds();
  double error = 1;
  if (b.size() >= 4) {
    const double degrees = std::max(b[3] - b[1], b[2] >= b[0] ? b[2] - b[0] : b[2] - b[0] + 360);
    error = std::ceil(degrees / 180 * proto::kSemiMajor_m * 3.2);
  }
  for (const proto::LevelSummary& level : manifest.levels()) error = std::max(error, 2 * level.geometric_error());
  return error;
}

RefineErrors::RefineErrors(const proto::Manifest& manifest)
    : empty_m_(empty_error_m(manifest)), last_sparse_(last_sparse_level(manifest).value_or(-1)) {}

std::array<double, 6> hemisphere_region(char hemisphere, double low_m, double high_m) {
  const double west = hemisphere == 'W' ? -kAntimeridian : 0;
  return {west, -kPole, west + kAntimeridian, kPole, low_m, high_m};
}

std::string tileset_json(const StoreReader& store, std::string_view query, std::string_view photo) {
  const proto::Manifest& manifest = store.manifest();
  const std::vector<TileExtent> roots = store.extents(0, 0, 0, 1, 0);
  Json root;
  Json children = Json::array();
  for (const TileExtent& node : roots) children.push_back(implicit_root(node, manifest, query));
  root["boundingVolume"] = root_volume(roots, manifest);
  root["geometricError"] = empty_error_m(manifest);
  root["refine"] = "REPLACE";
  root["children"] = std::move(children);

  Json out;
  out["asset"] = tileset_asset(manifest);
  if (!photo.empty()) out["asset"]["extras"]["texture"] = photo;
  out["schema"] = schema();
  out["geometricError"] = empty_error_m(manifest);
  out["root"] = std::move(root);
  return out.dump(1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cordillera::pipeline
