#include "raster/place/placement.h"

#include <gdal.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "proto/ellipsoid.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/place/area_of_use.h"
#include "raster/place/transform.h"

namespace cordillera::raster {
namespace {

/// Written geotransforms are rounded: what is as near as that is there.
constexpr double kRounded_px = 1.0 / 20;

using proto::Problem;

constexpr double kNoPlace = std::numeric_limits<double>::quiet_NaN();

double degrees_per_unit(const Crs& crs) { return crs.horizontal.GetAngularUnits() * 180 / std::numbers::pi; }

/// x moved by whole turns to [centre - turn/2, centre + turn/2).
double nearest_turn(double x, double centre, double turn) {
  const double turns = std::floor((x - centre) / turn + 0.5);
  return turns == 0 ? x : x - turns * turn;
}

/// How many of so many numbers, each a step after the one before, are above a limit.
int above(double limit, double first, double step, int count) {
  if (step == 0) return first > limit ? count : 0;
  const double before = (limit - first) / step;
  return step > 0 ? count - static_cast<int>(std::clamp(std::floor(before) + 1, 0.0, double(count)))
                  : static_cast<int>(std::clamp(std::ceil(before), 0.0, double(count)));
}

/// Whether the CRS itself says how its datum is taken to WGS 84 (+towgs84=, +nadgrids=). PROJ does so, and calls the whole way
/// ballpark all the same where the prime meridian is another than Greenwich.
bool says_its_way(const OGRSpatialReference& srs) {
  std::array<double, 7> shift{};
  return srs.GetTOWGS84(shift.data(), static_cast<int>(shift.size())) == OGRERR_NONE ||
         srs.GetExtension("DATUM", "PROJ4_GRIDS") != nullptr;
}

}  // namespace

proto::Result<void> check_placed(const Dataset& dataset) {
  std::array<double, 6> ignored{};
  if (dataset.handle->GetGeoTransform(ignored.data()) == CE_None) return {};
  if (dataset.handle->GetGCPCount() > 0)
    return Problem{"raster-not-georeferenced", dataset.name + " is placed by ground control points only",
                   "a raster with an affine geotransform, as this makes: " + copying_line("gdalwarp", dataset.name), ""};
  if (dataset.handle->GetMetadata("RPC") != nullptr)
    return Problem{
        "raster-not-georeferenced", dataset.name + " is placed by RPCs only (rational polynomials of a camera)",
        "a raster with an affine geotransform, as this makes: " + copying_line("gdalwarp -rpc -t_srs EPSG:CODE", dataset.name),
        ""};
  return Problem{"raster-not-georeferenced", dataset.name + " does not say where its pixels lie",
                 "a raster with an affine geotransform: with a world file beside it (posted, in one .zip), or made by " +
                     copying_line("gdal_translate -a_ullr WEST NORTH EAST SOUTH", dataset.name),
                 ""};
}

proto::Result<Placement> Placement::make(const Dataset& dataset, const Crs& crs) {
  const GdalScope scope(dataset.trust);
  Placement placement;
  placement.columns_ = dataset.columns;
  placement.rows_ = dataset.rows;
  if (auto done = placement.set_geotransform(dataset); !done.ok()) return done.problem();
  placement.meet_poles(crs);
  if (auto done = placement.check_degrees(dataset, crs); !done.ok()) return done.problem();
  if (auto done = placement.make_transform(dataset, crs); !done.ok()) return done.problem();
  placement.find_period(crs);
  placement.plate_ = placement.is_plate(crs);
  placement.same_px_ = placement.same_place_px(crs);
  placement.beyond_poles_px_ = placement.count_beyond_poles(crs);
  if (auto done = placement.compare_with_area_of_use(dataset, crs); !done.ok()) return done.problem();
  return placement;
}

proto::Result<void> Placement::set_geotransform(const Dataset& dataset) {
  if (auto placed = check_placed(dataset); !placed.ok()) return placed;
  dataset.handle->GetGeoTransform(forward_.data());
  const bool finite = std::all_of(forward_.begin(), forward_.end(), [](double v) { return std::isfinite(v); });
  if (!finite || !GDALInvGeoTransform(forward_.data(), inverse_.data()))
    return Problem{"raster-not-georeferenced", dataset.name + " has a geotransform that cannot be inverted", "pixels with a size",
                   ""};
  centre_x_ = forward_[0] + forward_[1] * columns_ / 2.0 + forward_[2] * rows_ / 2.0;
  return {};
}

/// A grid of the earth ends at a pole, with a pixel's edge or its centre, where nothing but a rounded header says otherwise:
/// there would be a hole.
void Placement::meet_poles(const Crs& crs) {
  if (!crs.horizontal.IsGeographic() || forward_[2] != 0 || forward_[4] != 0) return;
  const double pole = 90 / degrees_per_unit(crs), near = kRounded_px * std::abs(forward_[5]);
  for (const double inset : {0.0, 0.5}) {
    const double first = forward_[3] + forward_[5] * inset, last = forward_[3] + forward_[5] * (rows_ - inset);
    const auto met = [&](double y) { return std::abs(std::abs(y) - pole) < near ? std::copysign(pole, y) : y; };
    if ((met(first) == first && met(last) == last) || rows_ <= 2 * inset) continue;
    forward_[5] = (met(last) - met(first)) / (rows_ - 2 * inset);
    forward_[3] = met(first) - forward_[5] * inset;
    [[maybe_unused]] const int invertible =
        GDALInvGeoTransform(forward_.data(), inverse_.data());  // it was before, and rows are as far apart
    return;
  }
}

/// A file that says degrees and means metres would give tiles of nonsense.
proto::Result<void> Placement::check_degrees(const Dataset& dataset, const Crs& crs) const {
  if (!crs.horizontal.IsGeographic()) return {};
  const double unit_deg = degrees_per_unit(crs);
  constexpr double kSlack_deg = 5;  // rows past a pole are cut off; metres are thousands of degrees away
  for (int corner = 0; corner < 4; ++corner) {
    double x = corner & 1 ? columns_ : 0, y = corner & 2 ? rows_ : 0;
    image_to_map(&x, &y, 1);
    if (std::abs(y * unit_deg) > 90 + kSlack_deg || std::abs(x * unit_deg) > 540)
      return Problem{"crs-mismatch",
                     "the CRS of " + dataset.name + ", " + crs.label + ", is in degrees, but its corner is at " +
                         std::to_string(x * unit_deg) + ", " + std::to_string(y * unit_deg),
                     "a raster whose CRS fits its coordinates", crs.from == "request" ? "crs" : ""};
  }
  return {};
}

std::int64_t Placement::count_beyond_poles(const Crs& crs) const {
  if (!crs.horizontal.IsGeographic()) return 0;
  const double limit = 90 / degrees_per_unit(crs) + kRounded_px * (std::abs(forward_[4]) + std::abs(forward_[5]));
  // Line by line, along the longer side: a header may claim billions of rows.
  const bool by_rows = rows_ <= columns_;
  const double across = forward_[by_rows ? 5 : 4], along = forward_[by_rows ? 4 : 5];
  std::int64_t count = 0;
  for (int line = 0; line < std::min(rows_, columns_); ++line) {
    const double first = forward_[3] + (line + 0.5) * across + 0.5 * along;
    for (const double sign : {1.0, -1.0}) count += above(limit, sign * first, sign * along, std::max(rows_, columns_));
  }
  return count;
}

std::int64_t Placement::pixels_beyond_turn() const {
  if (turn_px_ == 0 || !(columns_ > turn_px_ + 1 + kRounded_px)) return 0;
  return static_cast<std::int64_t>(columns_ - std::floor(turn_px_)) * rows_;
}

bool Placement::transform_to(const Crs& crs, Way way) {
  const Ballpark ballpark = way == Way::ballpark ? Ballpark::allowed : Ballpark::refused;
  to_wgs84_ = to_wgs84(crs.horizontal, ballpark);
  if (!to_wgs84_) return false;
  knows_a_way_ = knows_a_way_ || way != Way::ballpark;
  double x[2] = {columns_ / 2.0, columns_ / 4.0}, y[2] = {rows_ / 2.0, rows_ / 4.0};
  image_to_map(x, y, 2);
  apply(*to_wgs84_, x, y, 2);
  // A raster of the whole earth in one projection may have its corners nowhere, but hardly both of these points.
  const int k = std::isfinite(x[0]) ? 0 : 1;
  if (!std::isfinite(x[k]) || std::abs(y[k]) > 90) return false;
  if (way == Way::elsewhere) {
    const auto use = area_of_use(crs.horizontal);
    if (!use) return false;
    const LonLat near = nearest_place(use->stated, x[k], y[k]);
    to_map_ = best_around(near.longitude_deg, near.latitude_deg, crs.horizontal, ballpark);
    if (!to_map_)
      to_map_ = best_around(middle_longitude_deg(use->stated), middle_latitude_deg(use->stated), crs.horizontal, ballpark);
  } else {
    to_map_ = best_around(x[k], y[k], crs.horizontal, ballpark);
  }
  if (!to_map_) return false;
  ignores_datum_ = way == Way::ballpark && !says_its_way(crs.horizontal);
  to_wgs84_.reset(to_map_->GetInverse());
  double back_x = x[k], back_y = y[k];
  apply(*to_map_, &back_x, &back_y, 1);
  return to_wgs84_ && std::isfinite(back_x);
}

proto::Result<void> Placement::make_transform(const Dataset& dataset, const Crs& crs) {
  // Ballpark operations ignore the datum: only when PROJ has nothing better.
  for (const Way way : {Way::here, Way::elsewhere, Way::ballpark}) {
    if (way == Way::elsewhere && !knows_a_way_) continue;
    way_ = way;
    if (transform_to(crs, way)) return {};
  }
  double x = columns_ / 2.0, y = rows_ / 2.0;
  image_to_map(&x, &y, 1);
  const double latitude_deg = y * degrees_per_unit(crs);
  if (crs.horizontal.IsGeographic() && std::abs(latitude_deg) > 90)
    return Problem{"crs-not-transformable",
                   dataset.name + " lies beyond the pole: its middle is at latitude " + std::to_string(latitude_deg),
                   "a raster whose latitudes lie within -90 to 90", crs.from == "request" ? "crs" : ""};
  return Problem{"crs-not-transformable",
                 "the CRS of " + dataset.name + ", " + crs.label + ", cannot be taken to WGS 84 at the raster's place",
                 "a CRS that PROJ can transform, and coordinates that lie in it", crs.from == "request" ? "crs" : ""};
}

/// Coordinates of one CRS read in another lie somewhere on the earth, mostly far from where that is meant to be used. A CRS is
/// used beyond its borders, too: what may be right is told alone. It is refused where nobody draws such a map: thousands of
/// kilometres away, in a projection of a country, or where no place leads back to its pixel. Maps around a pole and those whose x
/// is longitude reach as far as one likes, and degrees are degrees everywhere.
proto::Result<void> Placement::compare_with_area_of_use(const Dataset& dataset, const Crs& crs) {
  constexpr double kFar_deg = 5, kNearPole_deg = 85;
  const auto use = area_of_use(crs.horizontal);
  if (!use) return {};
  constexpr std::size_t kPlaces = 9;
  std::array<double, kPlaces> column{}, row{};
  for (std::size_t k = 0; k < kPlaces; ++k)
    column[k] = columns_ * static_cast<double>(k % 3) / 2, row[k] = rows_ * static_cast<double>(k / 3) / 2;
  std::array<double, kPlaces> x = column, y = row;
  to_degrees(x.data(), y.data(), kPlaces);
  double away_deg = 180;
  for (std::size_t k = 0; k < kPlaces; ++k)
    if (std::isfinite(x[k])) away_deg = std::min(away_deg, degrees_away(use->usual, x[k], y[k]));
  constexpr std::size_t kMiddle = 4;
  if (!std::isfinite(x[kMiddle])) return {};
  const bool only_elsewhere = way_ != Way::here && knows_a_way_ && degrees_away(use->stated, x[kMiddle], y[kMiddle]) > 0;
  if (!(away_deg > kFar_deg || only_elsewhere)) return {};
  beyond_ = dataset.name + " lies outside the area of use of " + crs.label + " (" + area_text(use->stated) + "): at " +
            place_text(x[kMiddle], y[kMiddle]);
  const bool local = crs.horizontal.IsProjected() && turn_ == 0 && use->stated.north_deg < kNearPole_deg &&
                     use->stated.south_deg > -kNearPole_deg;
  to_degrees_on_map(column.data(), row.data(), kPlaces);
  const bool nowhere = std::none_of(column.begin(), column.end(), [](double lon) { return std::isfinite(lon); });
  if (local && (away_deg > kAbsurd_deg || nowhere))
    return crs.from == "request"
               ? Problem{"crs-mismatch", beyond_, "the CRS that the raster's coordinates are in", "crs"}
               : Problem{"crs-mismatch", beyond_,
                         "a raster whose CRS fits its coordinates, as this makes: " + correcting_line(dataset.name), ""};
  beyond_ += "; is the CRS right?";
  return {};
}

/// Maps whose x is longitude, stretched, repeat around the earth: a raster may run over the antimeridian, or close.
void Placement::find_period(const Crs& crs) {
  if (crs.horizontal.IsGeographic()) {
    turn_ = 360 / degrees_per_unit(crs);
  } else {
    const double lon_0 = crs.horizontal.GetNormProjParm(SRS_PP_CENTRAL_MERIDIAN, 0.0);
    double x[5] = {lon_0 - 1, lon_0 + 1, lon_0 - 100, lon_0 + 100, lon_0 + 100}, y[5] = {0, 0, 0, 0, 50};
    for (double& lon : x) lon = nearest_turn(lon, 0, 360);
    apply(*to_map_, x, y, 5);
    const double unit = (x[1] - x[0]) / 2;
    const double slack = std::abs(unit) * 1e-6;
    const bool straight = std::abs(x[3] - x[2] - 200 * unit) < slack && std::abs(x[4] - x[3]) < slack && y[0] == y[3];
    turn_ = straight && unit > 0 ? 360 * unit : 0;
  }
  if (turn_ == 0 || forward_[2] != 0 || forward_[4] != 0) return;
  const double around_px = turn_ / std::abs(forward_[1]);
  turn_px_ = around_px;
  const double whole = std::round(around_px);
  if (std::abs(around_px - whole) < kRounded_px && columns_ + kRounded_px >= around_px && whole < 2147483647.0)
    turn_px_ = period_px_ = static_cast<int>(whole);
}

/// So near to its pixel a place comes back: beyond a map's outline it is far away. PROJ's way back is a millimetre off in some
/// projections, and pixels may be as small.
double Placement::same_place_px(const Crs& crs) const {
  constexpr double kSame_px = 0.5, kSame_m = 0.05;
  const double unit_m =
      crs.horizontal.IsGeographic() ? crs.horizontal.GetAngularUnits() * proto::kSemiMajor_m : crs.horizontal.GetLinearUnits();
  const double pixel_m = unit_m * std::min(std::hypot(forward_[1], forward_[4]), std::hypot(forward_[2], forward_[5]));
  return std::max(kSame_px, kSame_m / pixel_m);
}

/// WGS 84 and systems that PROJ equates with it need no call per point: their transformation moves nothing, tried over the
/// raster.
bool Placement::is_plate(const Crs& crs) const {
  if (!crs.horizontal.IsGeographic() || std::abs(degrees_per_unit(crs) - 1) > 1e-12) return false;
  std::vector<double> x, y;
  for (int r = 0; r <= 8; ++r) {
    for (int c = 0; c <= 8; ++c) {
      double px = columns_ * c / 8.0, py = rows_ * r / 8.0;
      image_to_map(&px, &py, 1);
      x.push_back(nearest_turn(px, 0, 360));
      y.push_back(std::clamp(py, -89.9, 89.9));
    }
  }
  std::vector<double> tx = x, ty = y;
  apply(*to_map_, tx.data(), ty.data(), tx.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double lon_error = std::abs(std::remainder(tx[k] - x[k], 360.0));
    if (!(lon_error < 1e-11 && std::abs(ty[k] - y[k]) < 1e-11)) return false;
  }
  return true;
}

void Placement::image_to_map(double* x, double* y, std::size_t count) const {
  for (std::size_t k = 0; k < count; ++k) {
    const double c = x[k], r = y[k];
    x[k] = forward_[0] + c * forward_[1] + r * forward_[2];
    y[k] = forward_[3] + c * forward_[4] + r * forward_[5];
  }
}

void Placement::map_to_image(double* x, double* y, std::size_t count) const {
  const bool straight = forward_[2] == 0 && forward_[4] == 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double u = turn_ == 0 ? x[k] : nearest_turn(x[k], centre_x_, turn_), v = y[k];
    if (straight) {  // division loses less than the inverse matrix does
      x[k] = (u - forward_[0]) / forward_[1];
      y[k] = (v - forward_[3]) / forward_[5];
    } else {
      x[k] = inverse_[0] + u * inverse_[1] + v * inverse_[2];
      y[k] = inverse_[3] + u * inverse_[4] + v * inverse_[5];
    }
  }
}

void Placement::to_pixels(double* x, double* y, std::size_t count) const {
  if (!plate_) {
    for (std::size_t k = 0; k < count; ++k) x[k] = nearest_turn(x[k], 0, 360);
    apply(*to_map_, x, y, count);
  }
  map_to_image(x, y, count);
}

void Placement::to_degrees(double* x, double* y, std::size_t count) const {
  image_to_map(x, y, count);
  if (!plate_) apply(*to_wgs84_, x, y, count);
}

void Placement::to_degrees_on_map(double* x, double* y, std::size_t count) const {
  if (plate_) return to_degrees(x, y, count);
  const std::vector<double> column(x, x + count), row(y, y + count);
  to_degrees(x, y, count);
  std::vector<double> back_x(x, x + count), back_y(y, y + count);
  to_pixels(back_x.data(), back_y.data(), count);
  for (std::size_t k = 0; k < count; ++k) {
    const double off_x = turn_px_ > 0 ? std::remainder(back_x[k] - column[k], turn_px_) : back_x[k] - column[k];
    if (!(std::abs(off_x) < same_px_ && std::abs(back_y[k] - row[k]) < same_px_)) x[k] = y[k] = kNoPlace;
  }
}

}  // namespace cordillera::raster
