#pragma once
// Where pixels lie on the earth: longitude/latitude (WGS 84) <-> pixel coordinates, exactly, point by point.
#include <ogr_spatialref.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "proto/result.h"
#include "raster/open/dataset.h"
#include "raster/place/crs.h"

namespace cordillera::raster {

/// Does the raster say where its pixels lie, in whatever CRS?
proto::Result<void> check_placed(const Dataset& dataset);

/// Pixel coordinates: pixel (c, r) covers [c, c+1] x [r, r+1]; its centre is (c + 0.5, r + 0.5). Points that have no image are
/// NaN.
class Placement {
 public:
  static proto::Result<Placement> make(const Dataset& dataset, const Crs& crs);

  /// In place: x longitude -> pixel column, y latitude -> pixel row. Longitudes in any turn.
  void to_pixels(double* x, double* y, std::size_t count) const;
  /// In place: pixel column -> longitude, row -> latitude; longitudes are taken to within a turn of the raster's centre.
  void to_degrees(double* x, double* y, std::size_t count) const;
  /// The same, but NaN where that place has its image elsewhere: beyond the outline of a map of the earth PROJ goes on, and tells
  /// places that other pixels have.
  void to_degrees_on_map(double* x, double* y, std::size_t count) const;

  /// PROJ knows no way from the CRS's datum to WGS 84, and takes it for that.
  bool ignores_datum() const { return ignores_datum_ && beyond_.empty(); }
  /// What is to be said of a raster that lies outside the area of use of its CRS; mostly empty.
  const std::string& beyond_area_of_use() const { return beyond_; }
  /// Pixels whose centres lie beyond a pole, more than what is rounded.
  std::int64_t pixels_beyond_poles() const { return beyond_poles_px_; }
  /// Pixels of columns after a full turn. One column may repeat the first, and does not count then.
  std::int64_t pixels_beyond_turn() const;

  /// Columns around the earth when the raster closes, else 0.
  int period_px() const { return period_px_; }
  /// Columns around the earth, whether the raster closes or not; 0: places do not repeat along a row.
  double turn_px() const { return turn_px_; }
  /// Pixel coordinates to the CRS's own, as GDAL has it.
  const std::array<double, 6>& pixel_to_map() const { return forward_; }
  /// So far is it around the earth in these; 0: they do not repeat.
  double turn() const { return turn_; }
  /// Longitude and latitude are columns and rows, scaled: no projection between.
  bool plate() const { return plate_; }
  /// And neither depends on the other's.
  bool straight_plate() const { return plate_ && forward_[2] == 0 && forward_[4] == 0; }

 private:
  Placement() = default;
  proto::Result<void> set_geotransform(const Dataset& dataset);
  void meet_poles(const Crs& crs);
  proto::Result<void> check_degrees(const Dataset& dataset, const Crs& crs) const;
  proto::Result<void> make_transform(const Dataset& dataset, const Crs& crs);
  /// Which of PROJ's operations: the best at the raster's centre; the best where the CRS is meant to be used, for a raster beside
  /// that; one that ignores the datum.
  enum class Way { here, elsewhere, ballpark };
  bool transform_to(const Crs& crs, Way way);
  proto::Result<void> compare_with_area_of_use(const Dataset& dataset, const Crs& crs);
  void find_period(const Crs& crs);
  bool is_plate(const Crs& crs) const;
  std::int64_t count_beyond_poles(const Crs& crs) const;
  double same_place_px(const Crs& crs) const;
  void image_to_map(double* x, double* y, std::size_t count) const;
  void map_to_image(double* x, double* y, std::size_t count) const;

  int columns_ = 0, rows_ = 0;
  std::array<double, 6> forward_{}, inverse_{};  ///< pixel -> map, map -> pixel
  double centre_x_ = 0;                          ///< map coordinate of the raster's centre
  double turn_ = 0;                              ///< map distance once around the earth; 0: the map does not repeat
  int period_px_ = 0;
  double turn_px_ = 0;
  bool plate_ = false;
  bool knows_a_way_ = false;  ///< from the datum, if perhaps not here
  bool ignores_datum_ = false;
  Way way_ = Way::here;
  std::string beyond_;
  std::int64_t beyond_poles_px_ = 0;
  double same_px_ = 0;
  std::unique_ptr<OGRCoordinateTransformation> to_map_, to_wgs84_;
};

}  // namespace cordillera::raster
