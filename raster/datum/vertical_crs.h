#pragma once
// National height systems (NAVD88, DHHN2016, LN02, ...) through PROJ: which there are, and how far their zero is from the
// ellipsoid.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "raster/datum/geoid.h"
#include "raster/source.h"

namespace cordillera::raster {

/// A vertical coordinate reference system.
struct VerticalCrs {
  std::string name;        ///< as PROJ's database has it, such as "NAVD88 height"
  std::string definition;  ///< WKT
};

/// Heights above mean sea level with no word about which surface that is (EPSG:5714, 5715 and the like): no way to the ellipsoid
/// is theirs.
bool is_mean_sea_level(const VerticalCrs& crs);

/// What a value of 1 along its axis is.
struct HeightAxis {
  std::string unit;   ///< as PROJ calls it
  double unit_m = 0;  ///< its length; 0: not known
  bool depth = false;
};
HeightAxis axis_of(const VerticalCrs& crs);

/// The system that a text names: a code such as EPSG:5703 or 5703, or a name such as NAVD88 or "DHHN2016 height", without regard
/// to case, blanks and signs. Of a compound code, such as EPSG:25832+7837, the second. Nullopt when PROJ knows none of that name,
/// or several and none better than the others. Never a file.
std::optional<VerticalCrs> find_vertical_crs(const std::string& text);

/// Of EPSG's height systems at most four whose names hold the letters of a text, the newest code first: what it may mean.
std::vector<std::string> similar_height_systems(const std::string& text);

/// The vertical part of a compound CRS, given as WKT, without the grid that it may be bound to. Nullopt when it has none.
std::optional<VerticalCrs> vertical_part(const std::string& compound_wkt);

/// Whether the grid that the vertical part is bound to tells heights above another ellipsoid than that of WGS 84.
bool is_bound_elsewhere(const std::string& compound_wkt);

struct VerticalTransformation {
  std::unique_ptr<Geoid> geoid;  ///< heights of the system above the ellipsoid; not a number where the grid does not reach
  std::string grid;              ///< file names of the grids that it takes, separated by blanks; may be empty
};

/// The way from a height system to the WGS 84 ellipsoid that PROJ takes for the best in the area, among those whose grids are
/// installed. base_wkt: the raster's horizontal CRS, since some national datums belong to one; empty: WGS 84. Nullopt when PROJ
/// knows no way at all. Problems: geoid-not-found, which names the grid that is missing; geoid-does-not-cover; geoid-invalid.
proto::Result<std::optional<VerticalTransformation>> open_vertical_crs(const VerticalCrs& crs, const std::string& base_wkt,
                                                                       const Area& area, Trust trust);

}  // namespace cordillera::raster
