#include "raster/datum/vertical_crs.h"

#include <ogr_spatialref.h>
#include <proj.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/ellipsoid.h"
#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/utf8.h"
#include "raster/disk/geoid_folders.h"
#include "raster/gdal/proj_context.h"
#include "raster/place/crs.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Object = std::unique_ptr<PJ, Deleter<proj_destroy>>;
using List = std::unique_ptr<PJ_OBJ_LIST, Deleter<proj_list_destroy>>;
using Factory = std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, Deleter<proj_operation_factory_context_destroy>>;

std::optional<VerticalCrs> described(PJ_CONTEXT* context, const PJ* crs) {
  if (crs == nullptr || proj_get_type(crs) != PJ_TYPE_VERTICAL_CRS) return std::nullopt;
  const char* const wkt = proj_as_wkt(context, crs, PJ_WKT2_2019, nullptr);
  if (wkt == nullptr) return std::nullopt;
  return VerticalCrs{proto::shown_text(proj_get_name(crs)), wkt};  // a raster may say what it likes
}

struct NamedSystem {
  std::string name, code;
};

/// EPSG's height systems that are in use.
std::vector<NamedSystem> height_systems(PJ_CONTEXT* context) {
  PROJ_CRS_LIST_PARAMETERS* const wanted = proj_get_crs_list_parameters_create();
  const PJ_TYPE type = PJ_TYPE_VERTICAL_CRS;
  wanted->types = &type;
  wanted->typesCount = 1;
  int count = 0;
  PROJ_CRS_INFO** const list = proj_get_crs_info_list_from_database(context, "EPSG", wanted, &count);
  proj_get_crs_list_parameters_destroy(wanted);
  std::vector<NamedSystem> systems;
  for (int k = 0; k < count; ++k) {
    if (list[k]->deprecated == 0) systems.push_back({list[k]->name, list[k]->code});
  }
  proj_crs_info_list_destroy(list);
  return systems;
}

/// EPSG:5703, or 5703 alone: authority and code.
std::optional<std::pair<std::string, std::string>> code_of(const std::string& text) {
  if (const std::size_t colon = text.find(':'), plus = text.find('+'); plus != std::string::npos && colon < plus)
    return code_of(text.substr(0, colon + 1) + text.substr(plus + 1));
  const std::size_t colon = text.find(':');
  const auto all = [](std::string_view part, bool (*is)(char)) {
    return !part.empty() && std::all_of(part.begin(), part.end(), is);
  };
  if (colon == std::string::npos && all(text, proto::is_digit)) return std::pair{std::string("EPSG"), text};
  if (colon == std::string::npos || !all(text.substr(0, colon), proto::is_letter) ||
      !all(text.substr(colon + 1), proto::is_digit))
    return std::nullopt;
  return std::pair{text.substr(0, colon), text.substr(colon + 1)};
}

struct Axis {
  double metres = 1;  ///< above the system's zero, of the value 1: units may be feet, and depths count downwards
  std::string unit;
};

Axis vertical_axis(PJ_CONTEXT* context, const PJ* vertical) {
  const Object axes(proj_crs_get_coordinate_system(context, vertical));
  const char *direction = nullptr, *unit = nullptr;
  double factor = 1;
  if (!axes || proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, &direction, &factor, &unit, nullptr, nullptr) == 0)
    return {};
  return {direction != nullptr && proto::lower(direction) == "down" ? -factor : factor, unit == nullptr ? "" : unit};
}

/// The operation takes longitude, latitude and height above WGS 84 to the base CRS and the height system. Where the ellipsoid's
/// own height is 0, the system's is minus the undulation.
class OperationGeoid : public Geoid {
 public:
  /// Takes a copy of the operation, in a context of its own.
  OperationGeoid(ProjContext context, const PJ* operation, double metres)
      : context_(std::move(context)), operation_(proj_clone(context_.get(), operation)), metres_(metres) {}
  double undulation_m(double latitude_deg, double longitude_deg) const override {
    const PJ_COORD out =
        proj_trans(operation_.get(), PJ_FWD, proj_coord(std::remainder(longitude_deg, 360.0), latitude_deg, 0, HUGE_VAL));
    return std::isfinite(out.xyz.z) ? -out.xyz.z * metres_ : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  ProjContext context_;  // before what is made in it
  Object operation_;
  double metres_;
};

/// Grids that PROJ's own package has in another form, under a name that the older databases do not know: they name what was
/// published, which PROJ does not read.
struct OtherName {
  const char *published, *packaged;
};
constexpr OtherName kOtherNames[] = {{"GCG2016.txt", "de_bkg_gcg2016.tif"}};

/// The packaged name; empty where the database's is right.
std::string other_name(std::string_view grid) {
  const auto* const found =
      std::find_if(std::begin(kOtherNames), std::end(kOtherNames), [&](const OtherName& name) { return grid == name.published; });
  return found == std::end(kOtherNames) ? "" : found->packaged;
}

struct Grids {
  std::string names;    ///< separated by blanks
  std::string geoid;    ///< path of the one whose name is another: a geoid, which PROJ is not asked for
  std::string missing;  ///< the first that is not installed, and where it can be had
  int missing_count = 0;
  int year = 0;  ///< of the first that is not installed
};

/// A way that could be gone; lower is better: first all that is known well, then what is only near.
enum class Way : std::uint8_t { exact, near, none };

/// A ballpark step leaves coordinates as they are. Heights would then not be shifted at all, so such a way is none. Where the
/// last step alone is one, and of longitude and latitude, it only turns places on the ground to the base's datum: the height is
/// done by then, and an undulation hardly changes over metres. An earlier one would take heights above another ellipsoid for
/// those of this one. PROJ tells the steps only in the name.
Way way_kind(PJ_CONTEXT* context, const PJ* operation) {
  if (proj_coordoperation_has_ballpark_transformation(context, operation) == 0) return Way::exact;
  constexpr std::string_view kHorizontal = "ballpark geographic offset", kAny = "ballpark", kNextStep = " + ";
  const std::string name = proto::lower(proj_get_name(operation));
  const std::size_t first = name.find(kAny), step = name.rfind(kNextStep);
  const bool only = first != std::string::npos && name.find(kAny, first + 1) == std::string::npos;
  return only && step != std::string::npos && step < first && name.compare(first, kHorizontal.size(), kHorizontal) == 0
             ? Way::near
             : Way::none;
}

/// The year that grids carry in their names, to ask for the newest: g2018u0, geoid09, RAF20; 0: none.
int year_in(const std::string& name) {
  int of_two_digits = 0;
  for (std::size_t at = 0; at < name.size();) {
    std::size_t end = at;
    while (end < name.size() && proto::is_digit(name[end])) ++end;
    const int number = end - at <= 4 ? proto::number<int>(std::string_view(name).substr(at, end - at)).value_or(0) : 0;
    if (end - at == 4 && number >= 1900 && number < 2100) return number;
    if (end - at == 2 && of_two_digits == 0) of_two_digits = number < 50 ? 2000 + number : 1900 + number;
    at = std::max(end, at + 1);
  }
  return of_two_digits;
}

Grids grids_of(PJ_CONTEXT* context, const PJ* operation) {
  Grids grids;
  for (int k = 0; k < proj_coordoperation_get_grid_used_count(context, operation); ++k) {
    const char *name = nullptr, *url = nullptr;
    int available = 0;
    proj_coordoperation_get_grid_used(context, operation, k, &name, nullptr, nullptr, &url, nullptr, nullptr, &available);
    if (name == nullptr) continue;
    if (!grids.names.empty()) grids.names += ' ';
    const std::string other = other_name(name);
    grids.names += other.empty() ? name : other;
    if (!other.empty()) {
      grids.geoid = find_in_geoid_folders(other);
      available = grids.geoid.empty() ? 0 : 1;
    }
    if (available != 0 || grids.missing_count++ > 0) continue;
    grids.missing = other.empty() ? name : other;
    grids.year = year_in(grids.missing);
    if (!other.empty())
      grids.missing += " (https://cdn.proj.org/" + other + ")";
    else if (url != nullptr && *url != 0)
      grids.missing.append(" (").append(url).append(")");
  }
  return grids;
}

Problem not_installed(const VerticalCrs& crs, const std::string& grid, Trust trust) {
  return {"geoid-not-found", "heights above " + crs.name + " need the grid " + grid + ", which is not installed",
          "the grid in " + geoid_home(trust) + "; or vertical_datum=EGM96, to take the heights as if above EGM96",
          "vertical_datum"};
}

/// Does the grid reach all of the area? Looked at in a net of points.
bool covers(const Geoid& geoid, const Area& area) {
  constexpr int kNet = 32;
  for (int r = 0; r <= kNet; ++r) {
    for (int c = 0; c <= kNet; ++c) {
      const double latitude = area.south_deg + (area.north_deg - area.south_deg) * r / kNet;
      if (std::isnan(geoid.undulation_m(latitude, area.west_deg + (area.east_deg - area.west_deg) * c / kNet))) return false;
    }
  }
  return true;
}

/// Longitudes and latitudes of the base with heights of the system, as WKT; empty when they do not go together.
std::string compound_of(const std::string& base_wkt, const std::string& vertical) {
  OGRSpatialReference base, geographic, heights, compound;
  if (base.SetFromUserInput(base_wkt.c_str()) != OGRERR_NONE || geographic.CopyGeogCSFrom(&base) != OGRERR_NONE)
    geographic.importFromEPSG(4326);
  if (heights.SetFromUserInput(vertical.c_str()) != OGRERR_NONE ||
      compound.SetCompoundCS("heights", &geographic, &heights) != OGRERR_NONE)
    return "";
  return wkt_of(compound);
}

/// The part of a compound CRS that says its heights; null: it is none.
Object second_of(PJ_CONTEXT* context, const std::string& compound_wkt) {
  const Object compound(proj_create(context, compound_wkt.c_str()));
  if (!compound || proj_get_type(compound.get()) != PJ_TYPE_COMPOUND_CRS) return nullptr;
  return Object(proj_crs_get_sub_crs(context, compound.get(), 1));
}

/// All ways from WGS 84 (three axes) to the base with the height system, the best first, whether their grids are installed or
/// not.
List operations(PJ_CONTEXT* context, const std::string& vertical, const std::string& base_wkt, const Area& area) {
  const Object compound(proj_create(context, compound_of(base_wkt, vertical).c_str())),
      ellipsoidal(proj_create(context, "EPSG:4979"));
  const Factory factory(proj_create_operation_factory_context(context, nullptr));
  if (!compound || !ellipsoidal || !factory) return nullptr;
  if (area.east_deg - area.west_deg < 360)
    proj_operation_factory_context_set_area_of_interest(context, factory.get(), std::remainder(area.west_deg, 360.0),
                                                        area.south_deg, std::remainder(area.east_deg, 360.0), area.north_deg);
  proj_operation_factory_context_set_spatial_criterion(context, factory.get(), PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(), PROJ_GRID_AVAILABILITY_IGNORED);
  return List(proj_create_operations(context, ellipsoidal.get(), compound.get(), factory.get()));
}

}  // namespace

bool is_mean_sea_level(const VerticalCrs& crs) {
  return proto::lower(crs.name).starts_with("msl height") || proto::lower(crs.name).starts_with("msl depth");
}

HeightAxis axis_of(const VerticalCrs& crs) {
  const ProjContext context = make_proj_context();
  const Object vertical(proj_create(context.get(), crs.definition.c_str()));
  if (!vertical) return {};
  const Axis axis = vertical_axis(context.get(), vertical.get());
  return {axis.unit, std::abs(axis.metres), axis.metres < 0};
}

std::optional<VerticalCrs> find_vertical_crs(const std::string& text) {
  const ProjContext context = make_proj_context();
  if (const auto code = code_of(text)) {
    const Object crs(
        proj_create_from_database(context.get(), code->first.c_str(), code->second.c_str(), PJ_CATEGORY_CRS, 0, nullptr));
    if (crs && proj_get_type(crs.get()) == PJ_TYPE_COMPOUND_CRS)
      return described(context.get(), Object(proj_crs_get_sub_crs(context.get(), crs.get(), 1)).get());
    return described(context.get(), crs.get());
  }
  const PJ_TYPE type = PJ_TYPE_VERTICAL_CRS;
  const List found(proj_create_from_name(context.get(), nullptr, text.c_str(), &type, 1, 1, 0, nullptr));
  const int count = found ? proj_list_get_count(found.get()) : 0;
  for (const std::string& wanted : {proto::lower(text), proto::lower(text) + " height"}) {
    for (int k = 0; k < count; ++k) {
      const Object crs(proj_list_get(context.get(), found.get(), k));
      if (proto::lower(proj_get_name(crs.get())) == wanted) return described(context.get(), crs.get());
    }
  }
  if (count == 1) return described(context.get(), Object(proj_list_get(context.get(), found.get(), 0)).get());
  const std::string letters = proto::letters_and_digits(text);
  for (const NamedSystem& system : height_systems(context.get())) {
    const std::string own = proto::letters_and_digits(system.name);
    if (letters.empty() || (own != letters && own != letters + "height")) continue;
    const Object crs(proj_create_from_database(context.get(), "EPSG", system.code.c_str(), PJ_CATEGORY_CRS, 0, nullptr));
    return described(context.get(), crs.get());
  }
  return std::nullopt;
}

std::vector<std::string> similar_height_systems(const std::string& text) {
  constexpr std::size_t kMost = 4, kFewestLetters = 3;
  const std::string letters = proto::letters_and_digits(text);
  if (letters.size() < kFewestLetters) return {};
  const ProjContext context = make_proj_context();
  std::vector<NamedSystem> similar;
  for (NamedSystem& system : height_systems(context.get())) {
    if (proto::letters_and_digits(system.name).find(letters) != std::string::npos) similar.push_back(std::move(system));
  }
  std::sort(similar.begin(), similar.end(), [](const NamedSystem& a, const NamedSystem& b) {
    return std::pair(a.code.size(), a.code) > std::pair(b.code.size(), b.code);
  });
  std::vector<std::string> names;
  for (std::size_t k = 0; k < std::min(similar.size(), kMost); ++k) names.push_back(similar[k].name);
  return names;
}

std::optional<VerticalCrs> vertical_part(const std::string& compound_wkt) {
  const ProjContext context = make_proj_context();
  const Object part = second_of(context.get(), compound_wkt);
  if (!part || proj_get_type(part.get()) != PJ_TYPE_BOUND_CRS) return described(context.get(), part.get());
  return described(context.get(), Object(proj_get_source_crs(context.get(), part.get())).get());
}

bool is_bound_elsewhere(const std::string& compound_wkt) {
  constexpr double kSame_m = 1;  // of half an axis: that of GRS 80 is WGS 84's, to a tenth of a millimetre
  const ProjContext context = make_proj_context();
  const Object part = second_of(context.get(), compound_wkt);
  if (!part || proj_get_type(part.get()) != PJ_TYPE_BOUND_CRS) return false;
  const Object target(proj_get_target_crs(context.get(), part.get()));
  const Object ellipsoid(target ? proj_get_ellipsoid(context.get(), target.get()) : nullptr);
  double a_m = 0, b_m = 0;
  if (!ellipsoid || proj_ellipsoid_get_parameters(context.get(), ellipsoid.get(), &a_m, &b_m, nullptr, nullptr) == 0)
    return false;
  return std::abs(a_m - proto::kSemiMajor_m) > kSame_m || std::abs(b_m - proto::kSemiMinor_m) > kSame_m;
}

proto::Result<std::optional<VerticalTransformation>> open_vertical_crs(const VerticalCrs& crs, const std::string& base_wkt,
                                                                       const Area& area, Trust trust) {
  ProjContext context = make_proj_context();
  const Object vertical(proj_create(context.get(), crs.definition.c_str()));
  const List ways = vertical ? operations(context.get(), crs.definition, base_wkt, area) : nullptr;
  Grids wanted;  // of the way that needs least: one grid before two, then the newest, then as PROJ has them
  for (const Way kind : {Way::exact, Way::near}) {
    for (int k = 0; ways && k < proj_list_get_count(ways.get()); ++k) {
      const Object way(proj_list_get(context.get(), ways.get(), k));
      if (way_kind(context.get(), way.get()) != kind) continue;
      const Grids grids = grids_of(context.get(), way.get());
      if (grids.missing_count > 0) {
        if (wanted.missing_count == 0 ||
            std::pair(grids.missing_count, -grids.year) < std::pair(wanted.missing_count, -wanted.year))
          wanted = grids;
        continue;
      }
      if (!grids.geoid.empty()) {
        auto geoid = open_geoid_grid(grids.geoid, area);
        if (!geoid) return geoid.problem();
        return std::optional(VerticalTransformation{std::move(*geoid), grids.names});
      }
      Object degrees(proj_normalize_for_visualization(context.get(), way.get()));
      if (!degrees) continue;
      auto geoid = std::make_unique<OperationGeoid>(make_proj_context(), degrees.get(),
                                                    vertical_axis(context.get(), vertical.get()).metres);
      if (!covers(*geoid, area)) return geoid_does_not_cover(grids.names.empty() ? crs.name : grids.names, area);
      return std::optional(VerticalTransformation{std::move(geoid), grids.names});
    }
  }
  if (wanted.missing_count > 0) return not_installed(crs, wanted.missing, trust);
  return std::optional<VerticalTransformation>();
}

}  // namespace cordillera::raster
