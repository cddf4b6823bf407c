// Orthophotos on 3D Tiles, as a client of glTF reads them.
#include "pipeline/faces/tiles_3d/photo_texture.h"

#include "pipeline/encode/region.h"
#include "raster/photo/orthophoto.h"
#include "tests/pipeline/gltf_tiles.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

constexpr int kPhotoLevel = 10;
constexpr TileAddress kPhotoFirst{kPhotoLevel, 1050, 640}, kPhotoLast{kPhotoLevel, 1053, 643},
    kPhotoInside{kPhotoLevel, 1051, 641};
constexpr double kTile_deg = 180.0 / (1 << kPhotoLevel);
const double kWest_deg = -180 + kPhotoFirst.x * kTile_deg, kSouth_deg = -90 + kPhotoFirst.y * kTile_deg;
/// The photo ends in the middle of the third column of tiles.
const raster::Area kShown = {kWest_deg, kSouth_deg, kWest_deg + 2.5 * kTile_deg, kSouth_deg + 4 * kTile_deg};

/// Red grows eastward, green northward, over the four tiles.
std::array<double, 3> colour_at(double longitude_deg, double latitude_deg) {
  return {20 + 50 * (longitude_deg - kWest_deg) / kTile_deg, 20 + 50 * (latitude_deg - kSouth_deg) / kTile_deg, 40};
}

class Plane : public raster::Orthophoto {
 public:
  const raster::Area& area() const override { return kShown; }
  const std::string& name() const override { return name_; }
  proto::Result<std::optional<std::vector<std::uint8_t>>> colours(const proto::Lattice& lattice,
                                                                  const raster::VertexWindow& window) override {
    if (damaged) return proto::Problem{"raster-unreadable", "plane.tif is damaged", "", ""};
    std::vector<std::uint8_t> rgba;
    bool any = false;
    for (std::int32_t r = window.rows - 1; r >= 0; --r) {
      for (std::int32_t c = 0; c < window.columns; ++c) {
        const double lon = lattice.longitude_deg(window.west + c), lat = lattice.latitude_deg(window.south + r);
        const bool inside =
            lon >= kShown.west_deg && lon <= kShown.east_deg && lat >= kShown.south_deg && lat <= kShown.north_deg;
        for (const double v : colour_at(lon, lat)) rgba.push_back(inside ? static_cast<std::uint8_t>(std::lround(v)) : 0);
        rgba.push_back(inside ? 255 : 0);
        any |= inside;
      }
    }
    return any ? std::optional(rgba) : std::optional<std::vector<std::uint8_t>>();
  }
  bool damaged = false;

 private:
  std::string name_ = "plane.tif";
};

class PhotoTexture : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { dataset_ = new Dataset(kPhotoLevel, kPhotoFirst, kPhotoLast, hills()); }
  static void TearDownTestSuite() {
    delete dataset_;
    dataset_ = nullptr;
  }
  static faces::Terrain terrain(faces::Look look) {
    if (!look.photo) look.photo = std::make_shared<Plane>();
    return dataset_->terrain(std::move(look));
  }
  static Gltf tile(const faces::Terrain& terrain, const TileAddress& at) { return Gltf(bytes_of(terrain, path_of(at), "")); }

 private:
  static inline Dataset* dataset_ = nullptr;
};

/// The picture's colour at every vertex is that of the vertex's place.
void compare_places(const faces::Terrain& terrain, const TileAddress& at) {
  const std::string bytes = bytes_of(terrain, path_of(at), "");
  const Gltf gltf(bytes);
  ASSERT_EQ(gltf.photo.width, terrain.look().photo_side());
  ASSERT_EQ(gltf.photo.height, terrain.look().photo_side());
  const std::vector<Vec3> points = decode_glb(bytes)->points;
  ASSERT_EQ(gltf.surfaces[0].texcoords.size(), points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Geodetic place = geodetic(points[v]);
    const auto expected = colour_at(place.longitude * 180 / M_PI, place.latitude * 180 / M_PI);
    const Vec3 seen = gltf.photo.sampled(gltf.surfaces[0].texcoords[v]);
    EXPECT_NEAR(seen.x, expected[0], 0.7) << v;
    EXPECT_NEAR(seen.y, expected[1], 0.7) << v;
  }
}

TEST_F(PhotoTexture, LiesOnTheTileAsThePlacesDo) {
  for (const int finer : {0, 1}) {
    const faces::Terrain shown = terrain({.photo_finer = finer});
    compare_places(shown, kPhotoInside);
    compare_places(shown, kPhotoFirst.parent());
  }
}

TEST_F(PhotoTexture, TakesThePlaceOfTheGroundsColour) {
  for (const Normals normals : {Normals::vertex, Normals::none, Normals::texture}) {
    const Gltf gltf = tile(terrain({.normals = normals}), kPhotoInside);
    const Json& material = gltf.json["materials"][0];
    EXPECT_FALSE(material["pbrMetallicRoughness"].contains("baseColorFactor"));
    EXPECT_EQ(gltf.photo.width, 257);
    EXPECT_EQ(gltf.normal_map.width, normals == Normals::texture ? 257 : 0);
    EXPECT_EQ(gltf.surfaces[0].normals.empty(), normals == Normals::none);
    EXPECT_EQ(gltf.surfaces[0].tangents.empty(), normals != Normals::texture);
    EXPECT_EQ(gltf.surfaces[1].texcoords.size(), gltf.surfaces[1].positions.size()) << "skirts";
    EXPECT_EQ(gltf.json["extensionsRequired"], Json::array({"KHR_draco_mesh_compression", "EXT_texture_webp"}));
    EXPECT_EQ(gltf.json["extensionsUsed"], gltf.json["extensionsRequired"]);
  }
  const Gltf larger = tile(terrain({.photo_finer = 1}), kPhotoInside);
  EXPECT_EQ(larger.json["extensionsRequired"], Json::array({"KHR_draco_mesh_compression", "EXT_texture_webp"}));
  EXPECT_EQ(larger.json["extensionsUsed"].back(), "KHR_texture_transform");
}

TEST_F(PhotoTexture, NeighboursHaveTheSamePixelsOnTheirSide) {
  for (const int finer : {0, 1}) {
    const faces::Terrain shown = terrain({.photo_finer = finer});
    const int last = shown.look().photo_side() - 1;
    const Gltf own = tile(shown, kPhotoInside), east = tile(shown, {kPhotoLevel, kPhotoInside.x + 1, kPhotoInside.y}),
               north = tile(shown, {kPhotoLevel, kPhotoInside.x, kPhotoInside.y + 1});
    for (int k = 0; k <= last; ++k) {
      EXPECT_EQ(own.photo.pixel(k, last), east.photo.pixel(k, 0)) << k;
      EXPECT_EQ(own.photo.pixel(0, k), north.photo.pixel(last, k)) << k;
    }
  }
}

TEST_F(PhotoTexture, BesideThePhotoIsTheGroundOfOtherTiles) {
  const faces::Terrain shown = terrain({});
  const Gltf rim = tile(shown, {kPhotoLevel, kPhotoFirst.x + 2, kPhotoFirst.y});
  const std::array<int, 3> ground = {182, 175, 155};  // 0.47, 0.43 and 0.33 in sRGB
  EXPECT_EQ(rim.photo.pixel(100, 200), ground);
  EXPECT_EQ(rim.photo.pixel(100, 129), ground);
  EXPECT_NE(rim.photo.pixel(100, 128), ground);
  const Gltf beside = tile(shown, kPhotoLast);
  EXPECT_FALSE(beside.json.contains("images"));
  EXPECT_TRUE(beside.json["materials"][0]["pbrMetallicRoughness"].contains("baseColorFactor"));
}

TEST_F(PhotoTexture, MayLoseSomething) {
  const faces::Terrain exact = terrain({}), lossy = terrain({.photo_quality = 60});
  const Gltf one = tile(exact, kPhotoInside), other = tile(lossy, kPhotoInside);
  int greatest = 0;
  for (int r = 0; r < 257; r += 8)
    for (int c = 0; c < 257; c += 8)
      for (std::size_t k = 0; k < 3; ++k)
        greatest = std::max(greatest, std::abs(one.photo.pixel(r, c)[k] - other.photo.pixel(r, c)[k]));
  EXPECT_GT(greatest, 0);
  EXPECT_LT(greatest, 12);
}

TEST_F(PhotoTexture, TagsAndProblemsAreThoseOfTheTile) {
  const faces::Terrain shown = terrain({});
  const auto found = faces::find(path_of(kPhotoInside));
  EXPECT_EQ(found->resource->tag(shown, found->place), (*found->resource->make(shown, found->place))->etag);
  const auto photo = std::make_shared<Plane>();
  photo->damaged = true;
  const faces::Terrain damaged = terrain({.photo = photo});
  EXPECT_EQ(found->resource->make(damaged, found->place).problem().type, "raster-unreadable");
  const auto none = faces::find("tiles/10/0/0.glb");
  EXPECT_FALSE(none->resource->make(damaged, none->place).value());
}

TEST_F(PhotoTexture, IsNamedByTheTileset) {
  EXPECT_EQ(Json::parse(bytes_of(terrain({}), "tileset.json", ""))["asset"]["extras"]["texture"], "plane.tif");
}

TEST_F(PhotoTexture, HasToShowSomeOfTheTerrain) {
  const Plane photo;
  EXPECT_TRUE(faces::check_photo(photo, {kWest_deg - 1, kSouth_deg - 1, kWest_deg + 0.1, kSouth_deg + 0.1}).ok());
  EXPECT_TRUE(faces::check_photo(photo, {kWest_deg + 359, kSouth_deg, kWest_deg + 361, kSouth_deg + 1}).ok()) << "a turn away";
  const auto beside = faces::check_photo(photo, {0, 0, 1, 1});
  ASSERT_FALSE(beside.ok());
  EXPECT_EQ(beside.problem().type, "option-invalid");
  EXPECT_NE(beside.problem().detail.find("the terrain at 0.000 to 1.000 degrees east"), std::string::npos)
      << beside.problem().detail;
}

}  // namespace
}  // namespace cordillera::pipeline
