#pragma once
// The one lattice that every tile of a dataset stands on.
//
// Tiles form a quadtree. A tile of level z has kTileCells x kTileCells cells of its own level. All positions, of every level, are
// counted in cells of the *finest* level Z of the dataset ("units"): vertex (i, j) of the lattice has one longitude and latitude
// for every tile that touches it, and a coarser tile keeps exact positions of the finest lattice. Nothing is ever rounded on the
// way up, so neighbours and parents agree by integer equality. A tile of level z spans kTileCells << (Z - z) units; that is below
// 2^31 for every level because Z <= kMaxLevel.
#include <compare>
#include <cstdint>

namespace cordillera::proto {

inline constexpr int kTileCells = 256;
inline constexpr int kMaxLevel = 21;  ///< finest level allowed (cells of 4 cm): window columns, wrapped once, fit 32 bits

/// A tile of EPSG:4326, which has two roots at level 0; x = 0 is the western hemisphere. x counts from longitude -180 eastward, y
/// from the SOUTH (TMS); 0 <= x < 2 << z, 0 <= y < 1 << z.
struct TileAddress {
  int z = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
  friend auto operator<=>(const TileAddress&, const TileAddress&) = default;
  TileAddress parent() const { return {z - 1, x >> 1, y >> 1}; }
  /// The tile of a level that it lies in: itself, or one above it. level: 0 .. z.
  TileAddress at_level(int level) const { return {level, x >> (z - level), y >> (z - level)}; }
  /// Child c: bit 0 = east, bit 1 = north.
  TileAddress child(int c) const { return {z + 1, 2 * x + (c & 1), 2 * y + (c >> 1)}; }
};

/// The lattice of finest level Z: (columns()) x (rows() + 1) vertices; columns wrap at the antimeridian.
struct Lattice {
  int finest_level = 0;

  std::int64_t columns() const { return std::int64_t{2 * kTileCells} << finest_level; }
  std::int64_t rows() const { return std::int64_t{kTileCells} << finest_level; }
  double cell_deg() const { return 180.0 / static_cast<double>(rows()); }
  /// Longitude of column i in degrees; i may lie outside [0, columns()), the result then lies outside [-180, 180].
  double longitude_deg(std::int64_t i) const { return longitude_at_deg(static_cast<double>(i)); }
  /// And of a place between them.
  double longitude_at_deg(double i) const { return -180.0 + 360.0 * i / static_cast<double>(columns()); }
  /// Latitude of row j in degrees, j = 0 at the south pole.
  double latitude_deg(std::int64_t j) const { return -90.0 + 180.0 * static_cast<double>(j) / static_cast<double>(rows()); }

  /// Side of a tile of level z, and one cell of level z, in units.
  std::int64_t tile_units(int z) const { return std::int64_t{kTileCells} << (finest_level - z); }
  std::int64_t cell_units(int z) const { return std::int64_t{1} << (finest_level - z); }
  /// South-western vertex of a tile.
  std::int64_t west(const TileAddress& t) const { return t.x * tile_units(t.z); }
  std::int64_t south(const TileAddress& t) const { return t.y * tile_units(t.z); }
};

/// Tiles across and up at level z.
inline std::int32_t tiles_across(int z) { return std::int32_t{2} << z; }
inline std::int32_t tiles_up(int z) { return std::int32_t{1} << z; }

}  // namespace cordillera::proto
