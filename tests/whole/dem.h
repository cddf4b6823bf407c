#pragma once
// Rasters for tests: written where they are needed, from a function or from a picture.
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "proto/lattice.h"

namespace cordillera::whole {

/// Height of pixel (c, r), counted from the north-western one.
using HeightOf = std::function<double(int c, int r)>;

inline constexpr double kNoData = -9999;
/// Vertices from one side of a tile to the other.
inline constexpr std::int64_t kTile = proto::kTileCells;

/// A GeoTIFF to be written: float32, nodata kNoData.
struct Dem {
  int columns = 0, rows = 0;
  std::array<double, 6> geotransform{};
  HeightOf height;
  std::string crs = "EPSG:4326";
  bool points = false;         ///< pixel-is-point
  std::optional<int> level{};  ///< whose lattice the pixels stand on: the finest to build
};

/// A pixel at each vertex of a level's lattice (pixel-is-point): resampling changes nothing. west, north: vertex of the first
/// pixel.
struct Corner {
  int level = 0;
  std::int64_t west = 0, north = 0;
};
/// On land, and on no side of a tile.
inline constexpr Corner kCorner{13, 9000 * kTile + 30, 6000 * kTile + 150};
Dem points_of(const Corner& corner, int columns, int rows, HeightOf height);
/// Pixels that are cells of a level's lattice (pixel-is-area).
Dem cells_of(const Corner& corner, int columns, int rows, HeightOf height);

/// Heights from a picture, a character a pixel, rows from the north: '.' no data, '0'..'9' that many times unit_m.
struct Picture {
  std::vector<std::string> rows;
  double unit_m = 100;

  int width() const { return static_cast<int>(rows.front().size()); }
  int height() const { return static_cast<int>(rows.size()); }
  double operator()(int c, int r) const;
};

/// Rough terrain: noise of seven octaves, from -300 to 2000 m or so.
HeightOf rough(std::uint32_t seed);
/// The same, of which all that is lower is a sea of this height.
inline constexpr double kSea_m = 500;
HeightOf rough_with_sea(std::uint32_t seed);

/// A folder of its own, removed with the object.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string path(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// Blocks without any data are never stored (a sparse file). Throws std::runtime_error when GDAL cannot.
void write(const Dem& dem, const std::string& path);

/// Folder of real elevation models: $CORDILLERA_TEST_DATA, else ../shared/dem beside the checkout; empty when absent.
std::string real_dems();

}  // namespace cordillera::whole
