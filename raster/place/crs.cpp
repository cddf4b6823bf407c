#include "raster/place/crs.h"

#include <cpl_minixml.h>
#include <cpl_string.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string_view>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/parts.h"
#include "proto/utf8.h"
#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/place/crs_label.h"
#include "raster/place/grid_names.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr const char* kAcceptedCrs =
    "a geographic or projected CRS that PROJ can take to WGS 84, e.g. EPSG:25832, a PROJ string or WKT";

/// A vertical CRS that PROJ calls "unknown": a PROJ string has no name for it, nor has a GeoTIFF that was made of one.
constexpr const char* kNameless = "a vertical datum without a name";

/// The names of grids that PROJ writes as "@folder/a.gtx,b.gtx"; of one that was published for a datum of ours, that. One in a
/// folder is a file that somebody chose.
std::string names_of_grids(std::string_view grids) {
  std::string names;
  proto::each_part(grids, ',', [&](std::string_view part) {
    const std::string_view grid = part.substr(part.starts_with('@') ? 1 : 0);
    const std::string datum = grid == "null" ? "ellipsoid" : published_datum(grid);
    names += (names.empty() ? "" : ", ") + (datum.empty() ? name_of_grid(grid) : datum);
  });
  return proto::shown_text(names);
}

/// The name we give to a vertical CRS: one of ours when we know its geoid, else the grids that it names, else its own.
std::string known_datum(const OGRSpatialReference& srs, const std::string& grids) {
  const std::string own = text_of(srs.GetAttrValue("VERT_CS"));
  const std::string code = text_of(srs.GetAuthorityName("VERT_CS")) == "EPSG" ? text_of(srs.GetAuthorityCode("VERT_CS")) : "";
  if (code == "5773") return "EGM96";
  if (code == "3855") return "EGM2008";
  if (code == "5798") return "EGM84";
  std::string datum = text_of(srs.GetAttrValue("VERT_DATUM"));
  datum.resize(std::min(datum.size(), datum.find(" using geoidgrids=")));  // PROJ's own words: the file may be called as it likes
  const std::string letters = proto::letters_and_digits(own + datum);
  if (letters.find("egm96") != std::string::npos) return "EGM96";
  if (letters.find("egm2008") != std::string::npos || letters.find("egm08") != std::string::npos) return "EGM2008";
  if (letters.find("egm84") != std::string::npos) return "EGM84";
  if (!grids.empty()) return names_of_grids(grids);
  if (letters.find("ellipsoid") != std::string::npos) return "ellipsoid";
  return own == "unknown" ? kNameless : proto::shown_text(own);
}

/// A unit by its length.
std::string metres_text(double metres) {
  std::string text;
  proto::append_number(text, metres);
  return text + " m";
}

void take_vertical_part(OGRSpatialReference& srs, Crs& crs) {
  if (srs.IsCompound()) {
    crs.geoid_grids = text_of(srs.GetExtension("VERT_DATUM", "PROJ4_GRIDS"));
    crs.declared_datum = known_datum(srs, crs.geoid_grids);
    crs.compound_wkt = wkt_of(srs);
    const char* unit = nullptr;
    crs.height_unit_m = srs.GetTargetLinearUnits("VERT_CS", &unit);
    crs.height_unit = text_of(unit);
    OGRAxisOrientation orientation = OAO_Up;
    srs.GetAxis("VERT_CS", 0, &orientation);
    crs.depth = orientation == OAO_Down;
    srs.StripVertical();
  } else if (srs.GetAxesCount() == 3) {
    crs.declared_datum = "ellipsoid";
    OGRAxisOrientation orientation = OAO_Up;
    double metres = 1;
    srs.GetAxis(nullptr, 2, &orientation, &metres);
    if (metres > 0 && metres != 1) crs.height_unit = metres_text(metres);
    crs.depth = orientation == OAO_Down;
    srs.DemoteTo2D(nullptr);
  }
}

/// What the raster's own CRS leaves open about heights, the one asked for may say. A GeoTIFF keeps no grid's name: what had one
/// is nameless there, in its own unit.
proto::Result<void> take_missing_vertical(const Dataset& dataset, const Crs& asked, Crs& crs) {
  if (asked.declared_datum.empty()) return {};
  const bool nameless = crs.declared_datum == kNameless;
  if (crs.declared_datum.empty() || nameless) {
    crs.declared_datum = asked.declared_datum;
    crs.geoid_grids = asked.geoid_grids;
    crs.compound_wkt = asked.compound_wkt;
    crs.vertical_from = "request";
    if (nameless) return {};
    crs.height_unit = asked.height_unit;
    crs.height_unit_m = asked.height_unit_m;
    crs.depth = asked.depth;
  } else if (crs.declared_datum != asked.declared_datum) {
    return Problem{
        "crs-conflict",
        dataset.name + " says that its heights are above " + crs.declared_datum + ", and crs= says " + asked.declared_datum,
        "crs= without a vertical part; vertical_datum= overrules what a raster says", "crs"};
  }
  return {};
}

/// As GDAL takes it: a number alone is a code of EPSG.
std::string as_input(const std::string& requested) {
  const bool code = !requested.empty() && requested.find_first_not_of("0123456789") == requested.npos;
  return (code ? "EPSG:" : "") + requested;
}

proto::Result<OGRSpatialReference> parse(const std::string& requested) {
  OGRSpatialReference srs;
  if (srs.SetFromUserInput(as_input(requested).c_str(), kSealedCrs) != OGRERR_NONE)
    return Problem{"crs-unknown", "crs=" + proto::shown_text(requested) + " is no coordinate reference system that PROJ knows",
                   kAcceptedCrs, "crs"};
  return srs;
}

/// called: "the CRS of dem.tif, WGS 84", or the request's own words.
proto::Result<void> check_kind(const OGRSpatialReference& srs, const std::string& called, const std::string& from) {
  const std::string parameter = from == "request" ? "crs" : "";
  const auto refuse = [&](const std::string& why) {
    return Problem{"crs-unsupported", called + " " + why, kAcceptedCrs, parameter};
  };
  if (srs.IsLocal()) {
    Problem local = refuse("is a local or engineering system: it does not say where on the earth it is");
    if (from != "request")
      local.accepted = "crs= with the CRS that its coordinates are in: " + local.accepted, local.parameter = "crs";
    return local;
  }
  if (srs.IsGeocentric()) return refuse("is geocentric: a raster's columns and rows cannot be its axes");
  if (!srs.IsGeographic() && !srs.IsProjected()) return refuse("is neither geographic nor projected");
  return {};
}

/// Of a raster that names none: what lies beside it under its name, as Esri's programs write it. Beside a posted file lies
/// nothing.
std::optional<OGRSpatialReference> crs_beside(const Dataset& dataset) {
  constexpr std::uintmax_t kMostBytes = 1 << 20;
  std::error_code error;
  const auto is_small_file = [&](const std::filesystem::path& file) {
    return std::filesystem::is_regular_file(file, error) && std::filesystem::file_size(file, error) <= kMostBytes && !error;
  };
  OGRSpatialReference srs;
  for (const char* extension : {".prj", ".PRJ"}) {
    const std::filesystem::path prj = std::filesystem::path(dataset.path).replace_extension(extension);
    if (!is_small_file(prj)) continue;
    CPLStringList lines(CSLLoad(prj.c_str()), TRUE);
    while (lines.size() > 0 && CPLString(lines[0]).Trim().empty())
      lines.Assign(CSLRemoveStrings(lines.StealList(), 0, 1, nullptr), TRUE);  // gdalsrsinfo writes one
    if (srs.importFromESRI(lines.List()) == OGRERR_NONE && !srs.IsEmpty()) return srs;
  }
  // Of such a file nothing else is taken: it may name others.
  const std::filesystem::path pam = pam_of_unpacked(dataset.path);
  if (!is_small_file(pam)) return std::nullopt;
  const CPLXMLTreeCloser tree(CPLParseXMLFile(pam.c_str()));
  const char* const text = CPLGetXMLValue(tree.get(), "=PAMDataset.SRS", nullptr);
  if (text != nullptr && srs.SetFromUserInput(text, kSealedCrs) == OGRERR_NONE && !srs.IsEmpty()) return srs;
  return std::nullopt;
}

/// Whether a NetCDF variable of coordinates is called as these are: "lon", or "x" with a long_name of "Longitude".
bool is_called(CSLConstList metadata, const std::string& variable, const std::string& what) {
  const char* const long_name = CSLFetchNameValue(metadata, (variable + "#long_name").c_str());
  const std::string called = proto::lower(long_name != nullptr ? long_name : variable);
  return called == what.substr(0, 3) || called.find(what) != called.npos;
}

/// Of a NetCDF file that names none and whose coordinates are in degrees north and east, as COARDS and CF have it: GEBCO's and
/// GMT's grids. ETOPO1's are in "degrees", and called longitude and latitude. They do not say on which ellipsoid. Where
/// longitudes and latitudes are arrays of their own, the raster is on another grid.
std::optional<OGRSpatialReference> crs_of_degrees(const Dataset& dataset) {
  static constexpr std::string_view kNorth = " degrees_north degree_north degree_N degrees_N degreeN degreesN ";
  static constexpr std::string_view kEast = " degrees_east degree_east degree_E degrees_E degreeE degreesE ";
  static constexpr std::string_view kDegrees = " degrees degree deg ";
  if (dataset.driver != "netCDF") return std::nullopt;
  if (dataset.handle->GetMetadata("GEOLOCATION") != nullptr) return std::nullopt;
  bool north = false, east = false;
  const CSLConstList metadata = dataset.handle->GetMetadata();
  for (CSLConstList word = metadata; word != nullptr && *word != nullptr; ++word) {
    const std::string_view entry = *word;
    const std::size_t at = entry.find("#units=");
    if (at == entry.npos) continue;
    const std::string unit = " " + std::string(entry.substr(at + std::string_view("#units=").size())) + " ";
    const bool degrees = kDegrees.find(unit) != kDegrees.npos;
    const std::string variable(entry.substr(0, at));
    north = north || kNorth.find(unit) != kNorth.npos || (degrees && is_called(metadata, variable, "latitude"));
    east = east || kEast.find(unit) != kEast.npos || (degrees && is_called(metadata, variable, "longitude"));
  }
  OGRSpatialReference srs;
  return north && east && srs.importFromEPSG(4326) == OGRERR_NONE ? std::optional(srs) : std::nullopt;
}

/// A variable of depths, by CF's word for the direction, or its standard names of what is below.
bool counts_downwards(const Dataset& dataset) {
  if (const char* const positive = dataset.band->GetMetadataItem("positive")) return proto::same_letters(positive, "down");
  const char* const named = dataset.band->GetMetadataItem("standard_name");
  const std::string name = proto::lower(named != nullptr ? named : "");
  return name == "depth" || name.starts_with("depth_below_") || name.starts_with("sea_floor_depth");
}

}  // namespace

std::string wkt_of(const OGRSpatialReference& srs) {
  const char* const newest[] = {"FORMAT=WKT2_2019", nullptr};
  char* text = nullptr;
  const std::string wkt = srs.exportToWkt(&text, newest) == OGRERR_NONE ? text_of(text) : "";
  CPLFree(text);
  return wkt;
}

proto::Result<Crs> resolve_crs(const Dataset& dataset, const std::string& requested) {
  const GdalScope scope(dataset.trust);
  const OGRSpatialReference* own = dataset.handle->GetSpatialRef();
  // A local system says nothing of the earth: whoever names one knows more.
  if (own != nullptr && (own->IsEmpty() || (own->IsLocal() && !requested.empty()))) own = nullptr;
  auto beside = own == nullptr ? crs_beside(dataset) : std::nullopt;
  if (own == nullptr && !beside && requested.empty()) beside = crs_of_degrees(dataset);
  if (beside) own = &*beside;
  if (own == nullptr && requested.empty())
    return Problem{"raster-without-crs", dataset.name + " names no coordinate reference system",
                   "a raster with one, or crs=, " + std::string(kAcceptedCrs), "crs"};
  Crs crs;
  OGRSpatialReference srs;
  if (!requested.empty()) {
    auto parsed = parse(requested);
    if (!parsed) return parsed.problem();
    srs = *parsed;
  }
  crs.from = own == nullptr ? "request" : "source";
  OGRSpatialReference named = srs;
  if (own != nullptr) srs = *own;
  take_vertical_part(srs, crs);
  crs.vertical_from = crs.from;
  crs.label = crs_label(srs);
  const std::string called = "the CRS of " + dataset.name + ", " + crs.label + ",";
  if (auto kind = check_kind(srs, called, crs.from); !kind.ok()) return kind.problem();
  if (own != nullptr && !requested.empty()) {
    Crs asked;
    take_vertical_part(named, asked);
    // A copy with it would be refused, too.
    if (auto kind = check_kind(named, "crs=" + proto::shown_text(requested), "request"); !kind.ok()) return kind.problem();
    const char* const lenient[] = {"IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS",
                                   nullptr};
    if (!srs.IsSame(&named, lenient))
      return Problem{
          "crs-conflict",
          dataset.name + " already has the CRS " + crs.label + ", and crs=" + proto::shown_text(requested) + " is another",
          "no crs= for this raster; or, if its own CRS is wrong, a copy with the right one: " +
              correcting_line(dataset.name, as_input(requested)),
          "crs"};
    if (auto agreed = take_missing_vertical(dataset, asked, crs); !agreed.ok()) return agreed.problem();
  }
  crs.depth = crs.depth || (crs.declared_datum.empty() && counts_downwards(dataset));
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  crs.horizontal = srs;
  crs.horizontal_wkt = wkt_of(srs);
  return crs;
}

}  // namespace cordillera::raster
