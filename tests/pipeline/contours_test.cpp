// Contours as a map reads them: tiles by GDAL's own reader, lines against the heights between pixels, and tiles against their
// neighbours.
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogrsf_frmts.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/contours/contour_grid.h"
#include "pipeline/contours/interval.h"
#include "pipeline/contours/tile_lines.h"
#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/web_mercator.h"
#include "tests/pipeline/terrain_made.h"
#include "vector_tile.pb.h"

namespace cordillera::pipeline::contours {
namespace {

using namespace pipeline::testing;
using faces::Place;
using faces::Terrain;

constexpr int kPixel = kExtent / faces::kTilePixels;

/// The shipped sample as a build makes it.
const Terrain& sample() {
  static const BuiltSample kSample;
  return *kSample.terrain;
}

proto::Result<std::optional<faces::Document>> asked(const Terrain& terrain, const std::string& path,
                                                    std::string_view interval = {}) {
  auto found = faces::find(path);
  if (!found) throw std::logic_error("no face has " + path);
  found->place.interval = interval;
  return found->resource->make(terrain, found->place);
}
std::string bytes_of(const Terrain& terrain, const Place& p, std::string_view interval = {}) {
  const auto made = asked(
      terrain, "contours/" + std::to_string(p.z) + "/" + std::to_string(p.x) + "/" + std::to_string(p.y) + ".mvt", interval);
  if (!made.ok()) throw std::runtime_error(made.problem().line());
  return *made ? std::string((*made)->bytes) : "";
}
Json tilejson(const Terrain& terrain, std::string_view interval = {}) {
  const auto made = asked(terrain, "contours.json", interval);
  return made.ok() && *made ? Json::parse(std::string((*made)->bytes)) : Json();
}

/// A tile's lines by their heights, by GDAL; places in units of the tile.
struct Read {
  std::map<double, std::vector<TileLine>> lines;
  std::map<double, int> index;
  int features = 0;
};
Read read_by_gdal(const std::string& bytes, const Place& p) {
  GDALAllRegister();
  const std::string name = "/vsimem/" + std::to_string(p.z) + "-" + std::to_string(p.x) + "-" + std::to_string(p.y) + ".mvt";
  VSIFCloseL(
      VSIFileFromMemBuffer(name.c_str(), const_cast<GByte*>(reinterpret_cast<const GByte*>(bytes.data())), bytes.size(), FALSE));
  const std::string x = "X=" + std::to_string(p.x), y = "Y=" + std::to_string(p.y), z = "Z=" + std::to_string(p.z);
  const char* options[] = {"CLIP=NO", x.c_str(), y.c_str(), z.c_str(), nullptr};
  const std::unique_ptr<GDALDataset> tile(
      GDALDataset::Open(name.c_str(), GDAL_OF_VECTOR | GDAL_OF_VERBOSE_ERROR, nullptr, options, nullptr));
  Read read;
  if (!tile || tile->GetLayerCount() != 1) {
    ADD_FAILURE() << "GDAL does not read the tile";
    return read;
  }
  OGRLayer& layer = *tile->GetLayer(0);
  EXPECT_STREQ(layer.GetName(), "contours");
  const double half = std::numbers::pi * 6378137, unit = 2 * half / std::ldexp(kExtent, p.z);
  for (const auto& feature : layer) {
    const double ele = feature->GetFieldAsDouble("ele");
    ++read.features;
    read.index[ele] = feature->GetFieldAsInteger("index");
    const std::unique_ptr<OGRGeometry> lines(OGRGeometryFactory::forceToMultiLineString(feature->GetGeometryRef()->clone()));
    for (const OGRLineString* line : *lines->toMultiLineString()) {
      TileLine& out = read.lines[ele].emplace_back();
      for (const OGRPoint& at : *line) {
        out.push_back({static_cast<std::int32_t>(std::lround((at.getX() + half) / unit - double{kExtent} * p.x)),
                       static_cast<std::int32_t>(std::lround((half - at.getY()) / unit - double{kExtent} * p.y))});
      }
    }
  }
  return read;
}

/// The same without GDAL, from the specification: segments with their heights.
using Segment = std::tuple<std::int32_t, std::int64_t, std::int64_t, std::int64_t, std::int64_t>;
std::set<Segment> segments_across(const std::string& bytes, const Place& p, bool vertical, std::int64_t side) {
  proto::VectorTile tile;
  std::set<Segment> out;
  if (!tile.ParseFromString(bytes)) throw std::runtime_error("no vector tile");
  if (tile.layers_size() == 0) return out;
  for (const auto& feature : tile.layers(0).features()) {
    const auto& value = tile.layers(0).values(static_cast<int>(feature.tags(1)));
    std::int64_t x = std::int64_t{kExtent} * p.x, y = std::int64_t{kExtent} * p.y;
    const auto& g = feature.geometry();
    for (int k = 0; k < g.size();) {
      const std::uint32_t command = g[k++];
      for (std::uint32_t n = 0; n < command >> 3; ++n, k += 2) {
        const auto step = [&](int at) { return static_cast<std::int32_t>(g[at] >> 1) ^ -static_cast<std::int32_t>(g[at] & 1); };
        const std::int64_t fromx = x, fromy = y;
        x += step(k), y += step(k + 1);
        const std::int64_t a = vertical ? fromx : fromy, b = vertical ? x : y;
        // along the side, the buffer's far ends are cut elsewhere in each tile
        if ((command & 7) == 2 && std::min(a, b) <= side && std::max(a, b) >= side && a != b)
          out.insert({static_cast<std::int32_t>(value.sint_value()), std::min(fromx, x), std::max(fromx, x),
                      fromx < x ? fromy : y, fromx < x ? y : fromy});
      }
    }
  }
  return out;
}

/// Pairs of tiles of a zoom with a common side: what crosses it in both. Returns how many segments there were.
std::size_t compare_sides(const Terrain& terrain, int zoom, std::string_view interval = {}) {
  const auto extent = *faces::extent_of(terrain.manifest());
  std::map<std::pair<std::int32_t, std::int32_t>, std::string> drawn;  // each tile once: it is beside up to four others
  const auto bytes_at = [&](const Place& p) -> const std::string& {
    const auto [at, is_new] = drawn.try_emplace({p.x, p.y});
    if (is_new) at->second = bytes_of(terrain, p, interval);
    return at->second;
  };
  std::size_t seen = 0;
  for (std::int32_t y = 0; y < 1 << zoom; ++y) {
    for (std::int32_t x = 0; x < 1 << zoom; ++x) {
      if (!faces::touches(extent, zoom, x, y)) continue;
      const Place here{.z = zoom, .x = x, .y = y}, east{.z = zoom, .x = x + 1, .y = y}, south{.z = zoom, .x = x, .y = y + 1};
      for (const auto& [other, vertical] : {std::pair(east, true), std::pair(south, false)}) {
        if (!faces::inside(faces::Grid::web_mercator, other) || !faces::touches(extent, zoom, other.x, other.y)) continue;
        const std::int64_t side = std::int64_t{kExtent} * (vertical ? other.x : other.y);
        const auto mine = segments_across(bytes_at(here), here, vertical, side);
        EXPECT_EQ(mine, segments_across(bytes_at(other), other, vertical, side))
            << zoom << "/" << x << "/" << y << (vertical ? " east" : " south");
        seen += mine.size();
      }
    }
  }
  return seen;
}

/// Heights where a line runs from pixel to pixel, one of its coordinates being that of centres: between two of them, in metres.
/// Nothing where a height is missing or the point was cut from a segment.
struct Between {
  double height_m = 0, rise_m = 0;
};
std::optional<Between> between(const raster::HeightSteps& grid, const TilePoint& p) {
  const auto centre = [](std::int32_t at) { return ((at - kPixel / 2) % kPixel + kPixel) % kPixel == 0; };
  const double column = (p.x - kPixel / 2) / double{kPixel} + kReach, row = (p.y - kPixel / 2) / double{kPixel} + kReach;
  const auto at = [&](double c, double r) {
    return grid.height[static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(c)];
  };
  const auto cut_off = [](std::int32_t side) { return side == -kBuffer || side == kExtent + kBuffer; };
  if (cut_off(p.x) || cut_off(p.y) || (!centre(p.x) && !centre(p.y))) return std::nullopt;
  const std::int32_t a = at(std::floor(column), std::floor(row)), b = at(std::ceil(column), std::ceil(row));
  if (a == raster::kNoHeightHere || b == raster::kNoHeightHere) return std::nullopt;
  if (centre(p.x) && centre(p.y)) {  // rounded to it, from any of the four ways
    std::int32_t rise = 0;
    for (const auto& [c, r] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)})
      rise = std::max(rise, std::abs(at(column + c, row + r) - a));
    return Between{a / 1000.0, rise / 1000.0};
  }
  const double share = column - std::floor(column) + row - std::floor(row);
  return Between{(a + share * (b - a)) / 1000.0, std::abs(b - a) / 1000.0};
}

TEST(Contours, RunWhereTheHeightsAreTheirs) {
  const proto::Source& source = sample().manifest().source();
  const double relief_m = source.max_height() - source.min_height();
  std::size_t points = 0, unknown = 0;
  for (const Place p :
       {Place{.z = 10, .x = 308, .y = 371}, Place{.z = 11, .x = 617, .y = 742}, Place{.z = 8, .x = 77, .y = 92}}) {
    const Read read = read_by_gdal(bytes_of(sample(), p), p);
    const auto grid = contour_grid(sample(), p);
    ASSERT_TRUE(grid.ok() && *grid);
    for (const auto& [ele, lines] : read.lines) {
      EXPECT_EQ(std::fmod(ele, usual_interval(p.z, relief_m).mm / 1000.0), 0);
      for (const TileLine& line : lines) {
        for (const TilePoint& at : line) {
          const auto found = between(**grid, at);
          found ? ++points : ++unknown;
          if (found) {
            EXPECT_NEAR(found->height_m, ele, found->rise_m / (2 * kPixel) + 0.002) << p.z << " at " << at.x << ", " << at.y;
          }
        }
      }
    }
  }
  EXPECT_GT(points, 5000u);
  EXPECT_LT(unknown, points / 20);
}

/// On the ground: what the meshes themselves have under the points. Between pixels they bend, so single points may be off.
TEST(Contours, LieWhereTheMeshesHaveTheirHeights) {
  const Place p{.z = 11, .x = 617, .y = 742};
  const int level = static_cast<int>(sample().manifest().max_level());
  double sum_m = 0, beside_m = 0;
  int count = 0;
  for (const auto& [ele, lines] : read_by_gdal(bytes_of(sample(), p), p).lines) {
    for (const TileLine& line : lines) {
      for (const TilePoint& at : line) {
        const auto off_m = [&, ele = ele](double pixels) {
          const double longitude = faces::pixel_longitude_deg(p.z, faces::kTilePixels * p.x + at.x / double{kPixel} + pixels);
          const double latitude = faces::pixel_latitude_deg(p.z, faces::kTilePixels * p.y + at.y / double{kPixel});
          return std::abs(sample().height_m(level, longitude, latitude).value() -
                          sample().undulation_m(longitude, latitude).value() - ele);
        };
        sum_m += off_m(0);
        beside_m += off_m(1);
        ++count;
      }
    }
  }
  EXPECT_GT(count, 1000);
  EXPECT_LT(sum_m / count, 1.5);
  EXPECT_GT(beside_m / count, 3 * 1.5) << "points a pixel to the side pass (control)";
}

TEST(Contours, OfOneHeightAreOneFeature) {
  for (const Place& p : {Place{.z = 9, .x = 154, .y = 185}, Place{.z = 11, .x = 617, .y = 742}}) {
    const Read read = read_by_gdal(bytes_of(sample(), p), p);
    EXPECT_GT(read.lines.size(), 1u);
    EXPECT_EQ(read.features, static_cast<int>(read.lines.size()));
  }
}

/// Between the least and the greatest height of a tile no multiple of the interval is without a line.
TEST(Contours, NoneIsMissing) {
  const Place p{.z = 11, .x = 617, .y = 742};
  const Read read = read_by_gdal(bytes_of(sample(), p), p);
  const auto grid = contour_grid(sample(), p);
  const auto [least, most] = std::minmax_element((*grid)->height.begin(), (*grid)->height.end());
  ASSERT_NE(*least, raster::kNoHeightHere);
  std::vector<double> wanted, found;
  for (std::int32_t m = (*least / 100000 + 1) * 100; m * 1000 <= *most; m += 100) wanted.push_back(m);
  for (const auto& [ele, lines] : read.lines) found.push_back(ele);
  EXPECT_GE(wanted.size(), 5u);
  EXPECT_EQ(found, wanted);
  EXPECT_EQ(read.index.at(1000), 10);
  EXPECT_EQ(read.index.at(500), 5);
  EXPECT_EQ(read.index.at(800), 2);
  EXPECT_EQ(read.index.at(700), 1);
}

TEST(Contours, OfTilesBesideEachOtherMeet) {
  EXPECT_GT(compare_sides(sample(), 9), 20u);
  EXPECT_GT(compare_sides(sample(), 10), 100u);
  EXPECT_GT(compare_sides(sample(), 11), 200u);
  EXPECT_GT(compare_sides(sample(), 11, "20"), 1000u);
  EXPECT_GT(compare_sides(sample(), 11, "24.384"), 1000u);
}

/// At 60 degrees a zoom goes over to finer meshes: the tiles on both sides of it have other heights in one place.
TEST(Contours, MeetWhereTheLevelChanges) {
  const Made north({{{7, 126, 103}, {7, 131, 110}}}, hills());
  const auto& manifest = north.terrain().manifest();
  const auto extent = *faces::extent_of(manifest);
  const faces::Zooms zooms = faces::zooms_of(manifest, extent);
  int changes = 0;
  for (int zoom = 3; zoom < zooms.last; ++zoom) {
    EXPECT_GT(compare_sides(north.terrain(), zoom), 0u) << zoom;
    std::set<int> levels;
    for (std::int32_t y = 0; y < 1 << zoom; ++y) {
      if (faces::touches(extent, zoom, 1 << (zoom - 1), y))
        levels.insert(faces::level_of(manifest, zooms, zoom, faces::row_latitude_deg(extent, zoom, y)));
    }
    changes += levels.size() > 1;
  }
  EXPECT_GT(changes, 0);
}

TEST(Contours, EndWithTheData) {
  const Made island({{{7, 126, 80}, {7, 131, 85}}}, hills());
  const auto extent = *faces::extent_of(island.terrain().manifest());
  std::size_t points = 0, beside_nothing = 0;
  for (std::int32_t k = 0; k < 64 * 64; ++k) {
    const Place p{.z = 6, .x = k % 64, .y = k / 64};
    if (!faces::touches(extent, p.z, p.x, p.y)) continue;
    const auto grid = contour_grid(island.terrain(), p);
    ASSERT_TRUE(grid.ok() && *grid);
    const std::string bytes = bytes_of(island.terrain(), p);
    if (bytes.empty()) continue;
    for (const auto& [ele, lines] : read_by_gdal(bytes, p).lines) {
      for (const TileLine& line : lines) {
        for (const TilePoint& at : line) {
          int data = 0;
          const int column = (at.x - kPixel / 2 + kReach * kPixel) / kPixel, row = (at.y - kPixel / 2 + kReach * kPixel) / kPixel;
          for (const auto& [c, r] :
               {std::pair(column, row), std::pair(column + 1, row), std::pair(column, row + 1), std::pair(column + 1, row + 1)})
            data += (*grid)->height[static_cast<std::size_t>(r * (*grid)->columns + c)] != raster::kNoHeightHere;
          EXPECT_GT(data, 0) << at.x << ", " << at.y;
          beside_nothing += data < 4;
          ++points;
        }
      }
    }
  }
  EXPECT_GT(points, 1000u);
  EXPECT_GT(beside_nothing, 10u);
}

TEST(Contours, ATileWithoutLinesDoesNotExist) {
  EXPECT_EQ(bytes_of(sample(), {.z = 11, .x = 0, .y = 0}), "");
  EXPECT_EQ(bytes_of(sample(), {.z = 12, .x = 1234, .y = 1484}), "") << "finer than the data";
  std::set<std::string> paths;
  faces::face_named("contours")->each_path(sample(), [&](const std::string& path) { paths.insert(path); });
  EXPECT_TRUE(paths.contains("contours.json"));
  EXPECT_TRUE(paths.contains("contours/11/617/742.mvt"));
  for (const std::string& path : paths) EXPECT_TRUE(asked(sample(), path).ok() && *asked(sample(), path)) << path;
}

TEST(Contours, TheTilejsonNamesLayersAndIntervals) {
  const Json plain = tilejson(sample()), chosen = tilejson(sample(), "20");
  EXPECT_EQ(plain["tiles"][0], "contours/{z}/{x}/{y}.mvt");
  EXPECT_EQ(chosen["tiles"][0], "contours/{z}/{x}/{y}.mvt?interval=20");
  ASSERT_EQ(plain["vector_layers"].size(), 1u);
  EXPECT_EQ(plain["vector_layers"][0]["id"], "contours");
  EXPECT_TRUE(plain["vector_layers"][0]["fields"] == Json({{"ele", "Number"}, {"index", "Number"}}));
  EXPECT_EQ(plain["zooms"].back()["interval"], 100);
  EXPECT_EQ(chosen["zooms"].back()["interval"], 20);
  EXPECT_EQ(chosen["zooms"].front()["interval"], 100) << "the least that the zoom allows";
}

TEST(Contours, AnIntervalThatIsNoneIsRefused) {
  for (const std::string text :
       {"0", "0.9", "-5", "+5", "1e2", "5001", "10m", "1.2345", "5.", ".5", "nan", " 5", "99999999999", "1.-5", "--1"}) {
    const auto tile = asked(sample(), "contours/11/617/742.mvt", text), json = asked(sample(), "contours.json", text);
    ASSERT_TRUE(!tile.ok() && !json.ok()) << text;
    EXPECT_EQ(tile.problem().type, "option-invalid");
    EXPECT_EQ(tile.problem().parameter, "interval");
    EXPECT_EQ(tile.problem().accepted, kIntervals);
  }
  for (const auto& [text, mm] :
       {std::pair("1", 1000), std::pair("12.192", 12192), std::pair("0007.5", 7500), std::pair("5000", 5000000)})
    EXPECT_EQ(interval_asked(text).value().mm, mm) << text;
}

/// Ground that is nothing but walls, at a line every metre if that were allowed.
TEST(Contours, ATileIsBounded) {
  const Made walls({{{7, 126, 80}, {7, 131, 85}}},
                   [](std::int64_t x, std::int64_t y) { return (x / 32 + y / 32) % 2 == 0 ? -8000.0 : 8000.0; });
  const auto extent = *faces::extent_of(walls.terrain().manifest());
  const int zoom = faces::zooms_of(walls.terrain().manifest(), extent).last;
  std::size_t most = 0;
  for (std::int32_t y = 0; y < 1 << zoom; ++y) {
    for (std::int32_t x = 0; x < 1 << zoom; ++x) {
      if (faces::touches(extent, zoom, x, y))
        most = std::max(most, bytes_of(walls.terrain(), {.z = zoom, .x = x, .y = y}, "1").size());
    }
  }
  EXPECT_GT(most, 10'000u);
  EXPECT_LT(most, 1'000'000u);
}

TEST(TileLines, AreCutAtTheBuffer) {
  const std::vector<TileLine> parts = clipped({{-100, 10}, {100, 10}, {100, -100}, {200, -100}, {200, 30}}, kBuffer);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0], (TileLine{{-64, 10}, {100, 10}, {100, -64}}));
  EXPECT_EQ(parts[1], (TileLine{{200, -64}, {200, 30}}));
  EXPECT_TRUE(clipped({{-100, 10}, {-70, 4000}}, kBuffer).empty());
}

TEST(TileLines, KeepWhatBendsAndWhatIsAtASide) {
  EXPECT_EQ(simplified({{100, 100}, {120, 101}, {140, 100}, {160, 103}, {180, 100}}),
            (TileLine{{100, 100}, {140, 100}, {160, 103}, {180, 100}}));
  const TileLine at_side = {{-8, 100}, {0, 100}, {8, 100}, {24, 100}, {40, 100}};
  EXPECT_EQ(simplified(at_side), (TileLine{{-8, 100}, {0, 100}, {8, 100}, {40, 100}}));
  const TileLine ring = {{100, 100}, {200, 100}, {200, 200}, {150, 200}, {100, 200}, {100, 100}};
  EXPECT_EQ(simplified(ring), (TileLine{{100, 100}, {200, 100}, {200, 200}, {100, 200}, {100, 100}}));
}

}  // namespace
}  // namespace cordillera::pipeline::contours
