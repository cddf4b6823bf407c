// Raster faces as a map client reads them: pictures decoded by the libraries that clients use, heights against the raster.
#include <gtest/gtest.h>
#include <png.h>
#include <webp/decode.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <set>

#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/outline_fill.h"
#include "pipeline/faces/pictures/pixel_heights.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/plan/plan.h"
#include "tests/pipeline/raster_tiles.h"
#include "tests/pipeline/terrain_made.h"

namespace cordillera::pipeline::faces {
namespace {

using namespace pipeline::testing;
using proto::TileAddress;

/// The shipped sample as a build makes it, and its lattice samples.
struct Sample : BuiltSample {
  Sample() {
    auto source = raster::open_source(request.raster_path, request.raster_name, request.trust, request.options).value();
    const proto::Plan plan = make_plan(*source, request.options).value();
    source = source_of_tiles(plan, std::move(source));
    const auto window = source->window(terrain->lattice());
    const auto columns = static_cast<std::int32_t>(window.east - window.west + 1);
    const auto rows = static_cast<std::int32_t>(window.north - window.south + 1);
    samples = source->sample(terrain->lattice(), window.west, window.south, columns, rows).value();
  }

  /// The raster between four samples, metres above the ellipsoid; what they span, and how far two triangles may be from it.
  struct Truth {
    double height_m = 0, twist_m = 0, low_m = 0, high_m = 0;
  };
  std::optional<Truth> at(double longitude_deg, double latitude_deg) const {
    const double cell_deg = terrain->lattice().cell_deg(), x = (longitude_deg + 180) / cell_deg,
                 y = (latitude_deg + 90) / cell_deg;
    const auto i = static_cast<std::int64_t>(std::floor(x)), j = static_cast<std::int64_t>(std::floor(y));
    if (i < samples.west || i + 1 >= samples.west + samples.columns) return std::nullopt;
    if (j < samples.south || j + 1 >= samples.south + samples.rows) return std::nullopt;
    const auto h = [&](std::int64_t di, std::int64_t dj) { return samples.at(i + di, j + dj); };
    for (const std::int64_t k : {0, 1, 2, 3}) {
      if (h(k & 1, k >> 1) == proto::kNoHeight) return std::nullopt;
    }
    const double s = x - static_cast<double>(i), t = y - static_cast<double>(j);
    const double low = (1 - s) * h(0, 0) + s * h(1, 0), high = (1 - s) * h(0, 1) + s * h(1, 1);
    const double twist = std::abs(h(0, 0) + h(1, 1) - h(0, 1) - h(1, 0)) / 4.0;
    const auto [least, most] = std::minmax({h(0, 0), h(1, 0), h(0, 1), h(1, 1)});
    constexpr double kStep_m = proto::kHeightStep_m;
    return Truth{((1 - t) * low + t * high) * kStep_m, twist * kStep_m, least * kStep_m, most * kStep_m};
  }

  proto::Samples samples;
};
const Sample& sample() {
  static const Sample kSample;
  return kSample;
}

TEST(TerrainRgb, HeightsAreTheRastersWithinTheStatedError) {
  const Terrain& terrain = *sample().terrain;
  for (const std::string face : {"terrain-rgb", "terrarium"}) {
    const Json json = tilejson_of(terrain, face + ".json");
    const int zoom = json["maxzoom"];
    const Json entry = json["zooms"].back();
    EXPECT_EQ(entry["zoom"], zoom);
    EXPECT_EQ(entry["levels"], Json::array({terrain.manifest().max_level()}));
    const double stated = entry["stated_max_error"];
    EXPECT_LT(stated, 2.2);
    std::size_t compared = 0, beyond = 0, outside = 0;
    double squares = 0;
    const Place first = tile_at(zoom, -71.55, 44.35), last = tile_at(zoom, -71.15, 44.15);
    for (std::int32_t x = first.x; x <= last.x; ++x) {
      for (std::int32_t y = first.y; y <= last.y; ++y) {
        const Picture picture = read_png(fetch(terrain, tile_path(face, zoom, x, y, ".png")).value_or(""), PNG_FORMAT_RGB);
        ASSERT_EQ(picture.side, 256u);
        for (std::size_t k = 0; k < 65536; ++k) {
          const Place tile{0, zoom, x, y};
          const double lon = longitude_of(tile, static_cast<double>(k % 256) + 0.5);
          const double lat = latitude_of(tile, static_cast<double>(k / 256) + 0.5);
          const auto truth = sample().at(lon, lat);
          if (!truth) continue;  // beside the raster
          const double height = face == "terrarium" ? terrarium_m(picture, k) : mapbox_m(picture, k);
          const double ellipsoidal = height + *terrain.undulation_m(lon, lat), off = std::abs(ellipsoidal - truth->height_m);
          // The error is stated at samples; between them mesh and raster are two ways of joining the same points.
          beyond += off > stated + truth->twist_m ? 1 : 0;
          outside += ellipsoidal < truth->low_m - stated || ellipsoidal > truth->high_m + stated ? 1 : 0;
          squares += off * off;
          ++compared;
        }
      }
    }
    EXPECT_GT(compared, 3 * 65536u);
    EXPECT_LT(beyond, compared / 25) << face;
    EXPECT_LT(outside, compared / 1000) << face;
    EXPECT_LT(std::sqrt(squares / static_cast<double>(compared)), stated) << face;
  }
}

/// A coarse level may go deeper than the data, by its error: that is no concern of finer zooms.
TEST(TerrainRgb, WhatIsCutOffBelowCountsWhereItIs) {
  const auto zooms = [](double deepest_m) {
    const Made made({{{7, 126, 80}, {7, 131, 85}}},
                    [=](std::int64_t i, std::int64_t j) { return (i + j) % 512 < 256 ? deepest_m : 100.0; });
    return std::pair{tilejson_of(made.terrain(), "terrain-rgb.json"), tilejson_of(made.terrain(), "terrarium.json")};
  };
  const auto [shallow, all_of_shallow] = zooms(-9000);
  const auto stated = [](const Json& zoom) { return zoom["stated_max_error"].get<double>(); };
  EXPECT_FALSE(shallow.contains("note"));
  EXPECT_NEAR(stated(shallow["zooms"].back()), stated(all_of_shallow["zooms"].back()), 0.06);
  EXPECT_GT(stated(shallow["zooms"].front()), stated(all_of_shallow["zooms"].front()) + 300);
  const auto [deep, all_of_deep] = zooms(-11000);
  EXPECT_TRUE(deep.contains("note"));
  const double more_m =
      deep["zooms"].back()["stated_max_error"].get<double>() - all_of_deep["zooms"].back()["stated_max_error"].get<double>();
  EXPECT_GT(more_m, 900);
  EXPECT_LT(more_m, 1200);
}

TEST(TerrainRgb, APixelIsTheMeshOverItsCentre) {
  const Terrain& terrain = *sample().terrain;
  for (const int zoom : {6, 9, 11}) {
    const Place at = tile_at(zoom, -71.3, 44.25);
    const auto grid = pixel_heights(terrain, at).value();
    ASSERT_TRUE(grid && grid->data);
    std::size_t compared = 0;
    for (std::int32_t row = 0; row < 256; row += 3) {
      for (std::int32_t column = 0; column < 256; column += 3) {
        const double lon = longitude_of(at, column + 0.5), lat = latitude_of(at, row + 0.5);
        const auto height = terrain.height_m(grid->level, lon, lat);
        ASSERT_EQ(height.has_value(), !std::isnan(grid->at(row, column)));
        if (!height) continue;
        EXPECT_NEAR(grid->at(row, column) + *terrain.undulation_m(lon, lat), *height, 1e-5);
        ++compared;
      }
    }
    EXPECT_GT(compared, zoom == 6 ? 5u : 1000u);
  }
}

/// Two tiles of level 7 are there; beside them levels 6 and 5 alone, and beyond these coarser ones.
TEST(TerrainRgb, ProvisionalHeightsAreOfTheFinestLevelAtThePlace) {
  proto::Manifest manifest = synthetic_manifest();
  manifest.set_provisional(true);
  const Made made({{{7, 126, 80}, {7, 126, 80}}, {{7, 128, 82}, {7, 128, 82}}}, hills(), 0, manifest);
  const Terrain& terrain = made.terrain();
  const int zoom = zooms_of(terrain.manifest(), *extent_of(terrain.manifest())).last;
  const double tiles_a_degree = std::ldexp(1, 7) / 180;
  std::set<int> levels;
  for (const double longitude : {-2.0, -0.7, 1.0}) {
    const Place at = tile_at(zoom, longitude, 23.2);
    const auto grid = pixel_heights(terrain, at).value();
    ASSERT_TRUE(grid && grid->data);
    for (std::int32_t k = 0; k < 65536; k += 97) {
      const double lon = longitude_of(at, k % 256 + 0.5), lat = latitude_of(at, k / 256 + 0.5);
      const auto x = static_cast<std::int32_t>((lon + 180) * tiles_a_degree),
                 y = static_cast<std::int32_t>((lat + 90) * tiles_a_degree);
      proto::TileAddress tile{7, x, y};
      while (tile.z > 0 && !terrain.mesh(tile)) tile = tile.parent();
      levels.insert(tile.z);
      const auto height = terrain.mesh(tile)->height_m(lon, lat);
      ASSERT_TRUE(height);
      // Triangles of coarse levels are so wide that some places have another one above them in space than in plan.
      ASSERT_NEAR(grid->at(k / 256, k % 256) + *terrain.undulation_m(lon, lat), *height, 2) << "level " << tile.z;
    }
  }
  for (const int level : {5, 6, 7}) EXPECT_TRUE(levels.count(level)) << level;
}

TEST(TerrainRgb, NoCellIsLargerThanAPixelAndTheLastZoomIsTheFirstWithFinestPixels) {
  const proto::Manifest& manifest = sample().terrain->manifest();
  const auto extent = extent_of(manifest);
  const Zooms zooms = zooms_of(manifest, *extent);
  EXPECT_EQ(zooms.first, 0);
  const double latitude = (extent->south_deg + extent->north_deg) / 2;
  const double pixel0_deg = 360.0 / 256 * std::cos(latitude * std::numbers::pi / 180);
  const auto cell_deg = [](int level) { return 180.0 / 256 / std::ldexp(1, level); };
  const auto finest = static_cast<int>(manifest.max_level());
  EXPECT_LE(std::ldexp(pixel0_deg, -zooms.last), cell_deg(finest));
  EXPECT_GT(std::ldexp(pixel0_deg, 1 - zooms.last), cell_deg(finest));
  for (int zoom = 0; zoom < zooms.last; ++zoom) {
    const int level = level_of(manifest, zooms, zoom, latitude);
    EXPECT_LE(cell_deg(level), std::ldexp(pixel0_deg, -zoom)) << zoom;
    EXPECT_TRUE(level == 0 || cell_deg(level - 1) > std::ldexp(pixel0_deg, -zoom)) << zoom;
  }
  EXPECT_EQ(level_of(manifest, zooms, zooms.last, latitude), finest);
  for (const double deg : {0.0, 44.0, -60.0, 84.0, -85.05}) EXPECT_NEAR(pixel_latitude_deg(5, latitude_pixel(5, deg)), deg, 1e-9);
}

TEST(TerrainRgb, WebpHoldsTheSamePixels) {
  const Terrain& terrain = *sample().terrain;
  const Place at = tile_at(10, -71.3, 44.25);
  for (const std::string face : {"terrain-rgb", "terrarium"}) {
    const Picture png = read_png(*fetch(terrain, tile_path(face, 10, at.x, at.y, ".png")), PNG_FORMAT_RGB);
    const Picture webp = read_webp(*fetch(terrain, tile_path(face, 10, at.x, at.y, ".webp")));
    EXPECT_EQ(webp.side, 256u);
    EXPECT_TRUE(png.bytes == webp.bytes) << face;
    EXPECT_EQ(tilejson_of(terrain, face + "-webp.json")["tiles"][0], face + "/{z}/{x}/{y}.webp");
  }
}

TEST(TerrainRgb, NeighboursSeeTheSameSurroundings) {
  // Level 7 on both sides of the antimeridian: columns 255 and 0.
  const Made made({{{7, 254, 80}, {7, 255, 83}}, {{7, 0, 80}, {7, 1, 83}}}, hills());
  const Terrain& terrain = made.terrain();
  const Json json = tilejson_of(terrain, "terrain-rgb.json");
  EXPECT_EQ(json["bounds"][0], -180) << "longitudes of a TileJSON do not wrap";
  EXPECT_EQ(json["bounds"][2], 180);
  EXPECT_EQ(tilejson_of(terrain, "layer.json")["bounds"][0], -180);
  EXPECT_NEAR(std::abs(json["center"][0].get<double>()), 180, 0.01);
  const int zoom = json["maxzoom"];
  const int row = tile_at(zoom, 179.9, 25).y;
  for (const std::int32_t far : {1 << (zoom - 2), 1 << (zoom - 1)}) {
    EXPECT_TRUE(fetch(terrain, tile_path("terrain-rgb", zoom, far, row, ".png")))
        << "within the bounds, on the other side of the earth";
    EXPECT_FALSE(fetch(terrain, tile_path("terrain-rgb", zoom, far, 0, ".png")));
  }
  std::size_t compared = 0;
  const Place last{0, zoom, (1 << zoom) - 1, tile_at(zoom, 179.9, 25).y}, first{0, zoom, 0, tile_at(zoom, 179.9, 24).y};
  for (const Place& west : {last, first}) {
    const Place east{0, zoom, (west.x + 1) % (1 << zoom), west.y}, south{0, zoom, west.x, west.y + 1};
    const auto a = pixel_heights(terrain, west).value(), b = pixel_heights(terrain, east).value();
    const auto c = pixel_heights(terrain, south).value();
    ASSERT_TRUE(a && b && c && a->data && b->data && c->data);
    for (std::int32_t k = 0; k < 256; ++k) {
      // The geoid's height alone depends, by less than a nanometre, on which pixels are asked together.
      const auto same = [](double p, double q) { return std::abs(p - q) < 1e-8 || (std::isnan(p) && std::isnan(q)); };
      EXPECT_TRUE(same(a->at(k, 256), b->at(k, 0)) && same(a->at(k, 255), b->at(k, -1))) << k;
      EXPECT_TRUE(same(a->at(256, k), c->at(0, k)) && same(a->at(255, k), c->at(-1, k))) << k;
      compared += !std::isnan(a->at(k, 256)) && !std::isnan(a->at(256, k)) ? 1 : 0;
    }
  }
  EXPECT_GT(compared, 100u);
}

TEST(TerrainRgb, HolesInTheDataAreFilled) {
  const Made made({{{7, 126, 80}, {7, 131, 85}}}, hills_with_voids());
  const Terrain& terrain = made.terrain();
  const int zoom = tilejson_of(terrain, "terrain-rgb.json")["maxzoom"];
  for (const int z : {zoom, zoom - 1}) {
    const Place in = tile_at(z, -1.4, 26);
    const Picture picture = read_png(*fetch(terrain, tile_path("terrain-rgb", z, in.x, in.y, ".png")), PNG_FORMAT_RGB);
    const Picture shades = read_png(*fetch(terrain, tile_path("hillshade", z, in.x, in.y, ".png")), PNG_FORMAT_GA);
    const auto grid = pixel_heights(terrain, in).value();
    const auto outline = terrain.outline().value();
    ASSERT_TRUE(grid);
    std::size_t holes = 0;
    for (std::int32_t k = 0; k < 65536; ++k) {
      const double height = grid->at(k / 256, k % 256), shown = mapbox_m(picture, static_cast<std::size_t>(k));
      const std::uint8_t alpha = shades.bytes[2 * static_cast<std::size_t>(k) + 1];
      if (!std::isnan(height)) {
        EXPECT_NEAR(shown, height, 0.05001);
        EXPECT_EQ(alpha, 255);
      } else if (outline->inside(z, 256 * in.x + k % 256, 256 * in.y + k / 256)) {
        EXPECT_GT(shown, 100) << "the hills are 130 m high at least";
        EXPECT_LT(shown, 1700);
        EXPECT_EQ(alpha, 255);
        ++holes;
      } else {
        EXPECT_EQ(alpha, 0);
      }
    }
    EXPECT_GT(holes, z == zoom ? 100u : 10u);
    EXPECT_LT(holes, 60000u);
  }
}

TEST(TerrainRgb, OutsideTheOutlineTheGroundGoesDownToTheGeoidWithoutACliff) {
  const Made made({{{7, 126, 80}, {7, 131, 85}}}, hills_with_voids());
  const Terrain& terrain = made.terrain();
  const int zoom = tilejson_of(terrain, "terrain-rgb.json")["maxzoom"];
  const Place first = tile_at(zoom, -2.81, 31.0), last = tile_at(zoom, 5.62, 22.51);
  double steepest_m = 0, least_m = 1e9;
  std::size_t outside = 0;
  for (std::int32_t x = first.x; x <= last.x; ++x) {
    for (std::int32_t y = first.y; y <= last.y; ++y) {
      const Place at{0, zoom, x, y};
      const auto data = pixel_heights(terrain, at).value(), shown = filled_grid(terrain, at, Beyond::faded).value();
      ASSERT_TRUE(data && shown);
      for (std::int32_t r = 0; r < 256; ++r) {
        for (std::int32_t c = 0; c < 256; ++c) {
          for (const auto& [down, right] : {std::pair(0, 1), std::pair(1, 0)}) {
            const double step = std::abs(shown->at(r + down, c + right) - shown->at(r, c));
            ASSERT_FALSE(std::isnan(step));
            const double of_data = std::abs(data->at(r + down, c + right) - data->at(r, c));
            if (std::isnan(of_data)) steepest_m = std::max(steepest_m, step);
          }
          outside += std::isnan(data->at(r, c)) ? 1 : 0;
          least_m = std::min(least_m, shown->at(r, c));
        }
      }
      const auto east = filled_grid(terrain, {0, zoom, x + 1, y}, Beyond::faded).value();
      for (std::int32_t k = 0; east && k < 256; ++k) {
        EXPECT_NEAR(shown->at(k, 256), east->at(k, 0), 1e-8) << k;
        EXPECT_NEAR(shown->at(k, 255), east->at(k, -1), 1e-8) << k;
      }
    }
  }
  EXPECT_GT(outside, 10000u);
  EXPECT_GE(least_m, 0);
  EXPECT_LT(steepest_m, 200) << "between pixels of 600 m; the hills stand up to 1670 m above the geoid";
}

/// The data ends at sides of tiles, and the bounds of its TileJSON are the whole circle: the ground goes down in the next tiles.
TEST(TerrainRgb, BesideDataOverTheAntimeridianTheGroundGoesDownInTheNextTiles) {
  const Made made({{{7, 254, 80}, {7, 255, 83}}, {{7, 0, 80}, {7, 1, 83}}}, hills());
  const Terrain& terrain = made.terrain();
  std::set<std::string> listed, shown = {"terrarium.json"};
  face_named("terrarium")->each_path(terrain, [&](const std::string& path) { listed.insert(path); });
  const int last = tilejson_of(terrain, "terrarium.json")["maxzoom"];
  double highest_m = 0, steepest_m = 0;
  for (int zoom = 1; zoom <= last; ++zoom) {
    const std::int32_t across = 1 << zoom;
    for (std::int32_t y = tile_at(zoom, 0, 28).y; y <= tile_at(zoom, 0, 22.51).y; ++y) {
      Picture east = read_png(fetch(terrain, tile_path("terrarium", zoom, 0, y, ".png")).value(), PNG_FORMAT_RGB);
      for (std::int32_t x = across - 1; x >= 0; --x) {
        const std::string path = tile_path("terrarium", zoom, x, y, ".png");
        const Picture tile = read_png(fetch(terrain, path).value(), PNG_FORMAT_RGB);
        for (std::size_t k = 0; k < 65536; ++k) {
          if (terrarium_m(tile, k) != 0) shown.insert(path);
          if (k % 256 != 255) continue;
          highest_m = std::max(highest_m, terrarium_m(tile, k));
          if (zoom == last) steepest_m = std::max(steepest_m, std::abs(terrarium_m(tile, k) - terrarium_m(east, k - 255)));
        }
        east = tile;
      }
    }
  }
  EXPECT_GT(highest_m, 1000);
  EXPECT_LT(steepest_m, 200) << "between pixels of 600 m";
  for (const std::string& path : shown) EXPECT_TRUE(listed.count(path)) << path;
  EXPECT_LT(listed.size(), 3 * shown.size()) << "none of those that lie far away";
}

/// A raster of 120 by 120 cells, its south-western corner at 10, 30 degrees, as a build makes it. height_m: of a row and a
/// column.
Terrain built(const TemporaryFolder& folder, double cell_deg, const std::function<double(int row, int column)>& height_m) {
  BuildRequest request;
  request.raster_path = folder / "isle.asc";
  request.raster_name = "isle.asc";
  request.id = "isle";
  request.store_path = folder / "a.db";
  request.options.set_crs("EPSG:4326");
  request.options.set_error(20);
  request.options.set_threads(1);
  request.options.set_device("cpu");
  std::ofstream raster(request.raster_path);
  raster << "ncols 120\nnrows 120\nxllcorner 10\nyllcorner 30\ncellsize " << cell_deg << '\n';
  for (int r = 0; r < 120; ++r) {
    for (int c = 0; c < 120; ++c) raster << height_m(r, c) << (c < 119 ? ' ' : '\n');
  }
  raster.close();
  const std::atomic<bool> stop = false;
  EXPECT_TRUE(build(request, nullptr, stop).ok());
  return Terrain(std::shared_ptr<const StoreReader>(StoreReader::open(request.store_path).value()));
}

/// 130 m of ground that is 2000 m high. Clients leave out tiles that lie below what the camera sees, so coarse ones must not be
/// flat there.
TEST(TerrainRgb, SmallHighGroundIsAsHighAtCoarseZooms) {
  const TemporaryFolder folder;
  const Terrain terrain = built(folder, 0.00001, [](int r, int c) { return 2000.0 + r + c / 2.0; });
  const Zooms zooms = zooms_of(terrain.manifest(), *extent_of(terrain.manifest()));
  ASSERT_GT(zooms.last, 15);
  for (int zoom = 9; zoom <= zooms.last; ++zoom) {  // of pixels that are 270 m wide
    const double column = longitude_pixel(zoom, 10.0006), row = latitude_pixel(zoom, 30.0006);
    const Place at{0, zoom, static_cast<std::int32_t>(column) / 256, static_cast<std::int32_t>(row) / 256};
    const auto shown = filled_grid(terrain, at, Beyond::faded).value();
    ASSERT_TRUE(shown);
    EXPECT_GT(shown->at(static_cast<std::int32_t>(row) % 256, static_cast<std::int32_t>(column) % 256), 1900) << zoom;
    const auto [least, most] = std::minmax_element(shown->height_m.begin(), shown->height_m.end());
    EXPECT_LT(*most, 2300) << zoom;
    EXPECT_TRUE(zoom >= 12 || *least == 0) << zoom;
  }
}

/// Meshes keep the sea to within their error only; what lies around it goes on from the sea as it is shown.
TEST(TerrainRgb, ASeaAtTheOutlineGoesOnAsItIsShown) {
  const TemporaryFolder folder;
  const Terrain terrain =
      built(folder, 0.001, [](int r, int c) { return std::max(0.0, 300 - 6.0 * std::hypot(r - 50, c - 70)); });
  ASSERT_TRUE(terrain.manifest().options().has_water());
  const Zooms zooms = zooms_of(terrain.manifest(), *extent_of(terrain.manifest()));
  std::size_t outside = 0, sea = 0;
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    const Place first = tile_at(zoom, 9.99, 30.13), last = tile_at(zoom, 10.13, 29.99);
    for (std::int32_t x = first.x; x <= last.x; ++x) {
      for (std::int32_t y = first.y; y <= last.y; ++y) {
        const auto data = pixel_heights(terrain, {0, zoom, x, y}).value(),
                   shown = filled_grid(terrain, {0, zoom, x, y}, Beyond::faded).value();
        for (std::int32_t k = 0; shown && k < 65536; ++k) {
          const double height_m = data->at(k / 256, k % 256);
          sea += height_m == 0 ? 1 : 0;
          if (!std::isnan(height_m)) continue;
          ASSERT_GE(shown->at(k / 256, k % 256), 0) << zoom;
          ++outside;
        }
      }
    }
  }
  EXPECT_GT(sea, 1000U);
  EXPECT_GT(outside, 10000U);
}

TEST(TerrainRgb, InsideTheBoundsEveryTileExistsAndOutsideNone) {
  // Two blocks far apart: most of their common bounds is empty.
  const Made made({{{7, 126, 80}, {7, 126, 80}}, {{7, 140, 92}, {7, 140, 92}}}, hills());
  const Terrain& terrain = made.terrain();
  const Json json = tilejson_of(terrain, "terrarium.json");
  const int last = json["maxzoom"];
  const double between_lon = (json["bounds"][0].get<double>() + json["bounds"][2].get<double>()) / 2;
  const Place empty = tile_at(last, between_lon, 30);
  const Picture sea = read_png(*fetch(terrain, tile_path("terrarium", last, empty.x, empty.y, ".png")), PNG_FORMAT_RGB);
  for (std::size_t k = 0; k < 65536; ++k) ASSERT_EQ(terrarium_m(sea, k), 0);
  const Picture clear = read_png(*fetch(terrain, tile_path("hillshade", last, empty.x, empty.y, ".png")), PNG_FORMAT_GA);
  for (std::size_t k = 0; k < 65536; ++k) ASSERT_EQ(clear.bytes[2 * k + 1], 0);
  const Place outside = tile_at(last, 100, 30);
  EXPECT_FALSE(fetch(terrain, tile_path("terrarium", last, outside.x, outside.y, ".png")));
  EXPECT_FALSE(fetch(terrain, tile_path("terrarium", last + 1, 2 * empty.x, 2 * empty.y, ".png"))) << "beyond the last zoom";
  EXPECT_TRUE(fetch(terrain, "terrarium/0/0/0.png"));
}

TEST(TerrainRgb, AListOfPathsIsEveryTileThatShowsSomething) {
  const Made made({{{7, 126, 80}, {7, 126, 80}}, {{7, 129, 82}, {7, 130, 82}}}, hills_with_voids());
  const Terrain& terrain = made.terrain();
  std::set<std::string> listed, wanted = {"terrain-rgb.json"};
  const auto list = [&](const std::string& path) { EXPECT_TRUE(listed.insert(path).second) << path; };
  face_named("terrain-rgb")->each_path(terrain, list);
  const Zooms zooms = zooms_of(terrain.manifest(), *extent_of(terrain.manifest()));
  for (int z = zooms.first; z <= zooms.last; ++z) {
    for (std::int32_t x = 0; x < 1 << z; ++x) {
      for (std::int32_t y = 0; y < 1 << z; ++y) {
        const auto grid = filled_grid(terrain, {0, z, x, y}, Beyond::faded).value();
        if (grid && grid->data) wanted.insert(tile_path("terrain-rgb", z, x, y, ".png"));
      }
    }
  }
  EXPECT_EQ(listed, wanted);
  EXPECT_GT(wanted.size(), 15u);
}

}  // namespace
}  // namespace cordillera::pipeline::faces
