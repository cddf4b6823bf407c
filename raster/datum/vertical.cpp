#include "raster/datum/vertical.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <vector>

#include "proto/letters.h"
#include "proto/parts.h"
#include "proto/utf8.h"
#include "raster/datum/vertical_crs.h"
#include "raster/disk/geoid_folders.h"
#include "raster/gdal/formats.h"
#include "raster/place/grid_names.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kAcceptedDatums =
    "EGM96, EGM2008, EGM84, ellipsoid, a height system such as EPSG:5703 or NAVD88, or the name of a geoid grid (GTX, GeoTIFF, "
    "GeographicLib PGM)";

struct KnownDatum {
  const char* name;
  std::vector<const char*> files;  ///< the best first
};
const std::array<KnownDatum, 3>& known_datums() {
  // EGM96: always the 15' grid, the one that every installation has; heights must not depend on what else is installed.
  static const std::array<KnownDatum, 3> known{
      {{"EGM96", {"egm96-15.pgm"}},
       {"EGM2008", {"egm2008-1.pgm", "egm2008-2_5.pgm", "egm2008-5.pgm", "us_nga_egm08_25.tif"}},
       {"EGM84", {"egm84-15.pgm", "egm84-30.pgm", "us_nga_egm84_30.tif"}}}};
  return known;
}

proto::Result<std::unique_ptr<Geoid>> open_geoid(const std::string& path, const Area& area) {
  return fs::path(path).extension() == ".pgm" ? open_geoid_pgm(path, area) : open_geoid_grid(path, area);
}

proto::Result<std::unique_ptr<Geoid>> open_known(const KnownDatum& datum, const Area& area, Trust trust) {
  std::string files;
  for (const char* file : datum.files) {
    if (const std::string path = find_in_geoid_folders(file); !path.empty()) return open_geoid(path, area);
    files += (files.empty() ? "" : ", ") + std::string(file);
  }
  if (proto::same_letters(datum.name, "EGM96"))
    if (const std::string path = egm96_path(); !path.empty()) return open_geoid(path, area);
  return Problem{"geoid-not-found",
                 "heights above " + std::string(datum.name) + " need a grid that is not installed: put one of " + files +
                     " into " + geoid_home(trust),
                 kAcceptedDatums, "vertical_datum"};
}

const KnownDatum* known(const std::string& name) {
  for (const KnownDatum& datum : known_datums())
    if (proto::same_letters(datum.name, name) || proto::same_letters(datum.name + std::string(" height"), name)) return &datum;
  return nullptr;
}

/// The ellipsoid as people name it: by the word, by the CRS whose heights are above it, or by that CRS's code.
bool names_ellipsoid(const std::string& name) {
  constexpr const char* kNames[] = {"ellipsoid", "ellipsoidal", "WGS84", "WGS 84", "EPSG:4979"};
  return std::any_of(std::begin(kNames), std::end(kNames), [&](const char* one) { return proto::same_letters(one, name); });
}

/// The grid file of a name, empty when there is none. Over HTTP only a bare name, looked up in the operator's folders.
std::string grid_file(const std::string& name, Trust trust) {
  std::error_code error;
  if (trust == Trust::operator_file && fs::is_regular_file(name, error)) return name;
  return name.find_first_of("/\\") == std::string::npos ? find_in_geoid_folders(name) : "";
}

proto::Result<VerticalDatum> of_known(const KnownDatum& known, const std::string& from, const Area& area, Trust trust) {
  auto geoid = open_known(known, area, trust);
  if (!geoid) return geoid.problem();
  return VerticalDatum{known.name, from, "", std::move(*geoid)};
}

/// Whether this is what a grid's file is called, without a folder. Manifests name grids so.
bool is_bare_grid_name(const std::string& name) {
  const std::string ending = extension_of(name);
  return name.find_first_of("/\\") == name.npos &&
         (ending == ".gtx" || ending == ".tif" || ending == ".tiff" || ending == ".pgm");
}

Problem unknown_datum(const std::string& name) {
  std::string similar;
  for (const std::string& one : similar_height_systems(name))
    similar += (similar.empty() ? "; is it one of these: " : ", ") + one;
  if (is_bare_grid_name(name)) similar = "; a grid of this name is looked for in the folders of CORDILLERA_GEOIDS";
  return {"geoid-not-found",
          "vertical_datum=" + proto::shown_text(name) +
              " is neither a height system known here nor a grid file that may be read" + similar,
          kAcceptedDatums, "vertical_datum"};
}

/// Who takes another datum than the system asked for loses what it says of the raster's values.
Problem with_z_scale(Problem problem, double z_scale) {
  if (z_scale == 1) return problem;
  char text[96];
  std::snprintf(text, sizeof text, "; with EGM96 z_scale=%.10g, too, as it says nothing of their unit and direction", z_scale);
  problem.accepted += text;
  return problem;
}

proto::Result<VerticalDatum> of_request(const VerticalAsked& asked, Trust trust, const Area& area) {
  const std::string& name = asked.requested;
  if (const std::string path = grid_file(name, trust); !path.empty()) {
    auto geoid = open_geoid(path, area);
    if (!geoid) return geoid.problem();
    return VerticalDatum{name_of_grid(name), "request", "", std::move(*geoid)};
  }
  const std::optional<VerticalCrs>& crs = asked.system;
  if (!crs) return unknown_datum(name);
  if (const KnownDatum* datum = known(is_mean_sea_level(*crs) ? kDefaultDatum : crs->name))
    return of_known(*datum, "request", area, trust);
  auto way = open_vertical_crs(*crs, asked.base_wkt, area, trust);
  if (!way) return with_z_scale(way.problem(), asked.system_z_scale);
  if (!*way)
    return with_z_scale(
        {"geoid-not-found",
         "PROJ knows no way from " + proto::shown_text(crs->name) +
             " to the ellipsoid where the raster lies: it is of another place, or has no grid",
         "EGM96, EGM2008, EGM84, ellipsoid, the height system of the place, or the name of a geoid grid that covers it",
         "vertical_datum"},
        asked.system_z_scale);
  return VerticalDatum{crs->name, "request", (*way)->grid, std::move((*way)->geoid)};
}

/// Nullopt: nothing that could be used.
proto::Result<std::optional<VerticalDatum>> of_source(const VerticalAsked& asked, const Area& area, Trust trust) {
  const auto crs = asked.compound_wkt.empty() ? std::nullopt : vertical_part(asked.compound_wkt);
  if (!crs || is_mean_sea_level(*crs)) return std::optional<VerticalDatum>();
  auto way = open_vertical_crs(*crs, asked.base_wkt, area, trust);
  if (!way) return way.problem();
  if (!*way) return std::optional<VerticalDatum>();
  return std::optional(VerticalDatum{crs->name, "source", (*way)->grid, std::move((*way)->geoid)});
}

Problem missing_grid(const std::string& grid, Trust trust) {
  const bool folders = trust == Trust::posted_file && grid.find_first_of("/\\") != grid.npos;
  return {"geoid-not-found",
          "the CRS names the geoid grid " + proto::shown_text(grid) + " for its heights, which is not " +
              (folders ? "looked for: it is named with a folder" : "installed"),
          "the grid in " + geoid_home(trust) + (folders ? ", under a name without a folder" : "") +
              "; or vertical_datum=EGM96, to take the heights as if above EGM96",
          "vertical_datum"};
}

/// One of them. Files often name a published grid for its datum: that is taken for one without a folder, so that heights do not
/// depend on what else is installed, and for one in a folder where there is no such file.
proto::Result<VerticalDatum> of_named_grid(const std::string& grid, const Area& area, Trust trust) {
  if (grid == "null") return VerticalDatum{"ellipsoid", "source", "", nullptr};
  const std::string path = grid_file(grid, trust);
  const KnownDatum* const datum = known(published_datum(fs::path(grid).filename().string()));
  if (datum != nullptr && (path.empty() || fs::path(grid).filename() == grid)) {
    auto published = of_known(*datum, "source", area, trust);
    if (published || path.empty()) return published;
  }
  if (path.empty()) return missing_grid(grid, trust);
  auto geoid = open_geoid(path, area);
  if (!geoid) return geoid.problem();
  return VerticalDatum{name_of_grid(path), "source", "", std::move(*geoid)};
}

/// By the grids that the CRS names: the first that covers the area, as PROJ does it. One marked with "@" may be missing, and
/// "null" is no shift. Where there is none, the height system's own way, if its grid is at hand.
proto::Result<VerticalDatum> of_named_grids(const VerticalAsked& asked, const Area& area, Trust trust) {
  if (is_bound_elsewhere(asked.compound_wkt))
    return Problem{"geoid-not-found",
                   "the geoid grid " + proto::shown_text(asked.geoid_grids) +
                       ", which the CRS names, has heights above another ellipsoid than that of WGS 84",
                   kAcceptedDatums, "vertical_datum"};
  Problem problem = missing_grid(asked.geoid_grids, trust);  // all of them may be allowed to be missing
  using Found = std::optional<proto::Result<VerticalDatum>>;
  Found found = proto::each_part(asked.geoid_grids, ',', [&](std::string_view part) -> Found {
    const bool optional = part.starts_with('@');
    auto datum = of_named_grid(std::string(part.substr(optional ? 1 : 0)), area, trust);
    if (datum) return datum;
    const bool missing = datum.problem().type == "geoid-not-found";
    if (!missing || !optional) problem = datum.problem();
    return (missing && optional) || problem.type == "geoid-does-not-cover" ? std::nullopt : Found(problem);
  });
  if (found && (found->ok() || found->problem().type != "geoid-not-found")) return std::move(*found);
  if (const KnownDatum* datum = known(asked.declared)) return of_known(*datum, "source", area, trust);
  if (auto own = of_source(asked, area, trust); own && *own) return std::move(**own);
  return found ? found->problem() : problem;
}

}  // namespace

std::vector<fs::path> geoid_places() {
  std::vector<fs::path> places = geoid_folders();
  if (const std::string path = egm96_path(); !path.empty()) places.emplace_back(path);
  return places;
}

std::optional<VerticalCrs> system_named(const std::string& requested, Trust trust) {
  if (requested.empty() || names_ellipsoid(requested) || known(requested) != nullptr || !grid_file(requested, trust).empty())
    return std::nullopt;
  return find_vertical_crs(requested);
}

proto::Result<VerticalDatum> resolve_vertical(const VerticalAsked& asked, Trust trust, const Area& area) {
  const std::string& name = asked.requested.empty() ? asked.declared : asked.requested;
  const std::string from = asked.requested.empty() ? "source" : "request";
  if (asked.requested.empty() && !asked.geoid_grids.empty()) return of_named_grids(asked, area, trust);
  // What a raster declares is read more strictly: WGS 84 may be no more than its horizontal datum's name there.
  const bool ellipsoid = asked.requested.empty() ? proto::same_letters(name, "ellipsoid") : names_ellipsoid(name);
  if (ellipsoid) return VerticalDatum{"ellipsoid", from, "", nullptr};
  if (const KnownDatum* datum = known(name)) return of_known(*datum, from, area, trust);
  if (!asked.requested.empty()) return of_request(asked, trust, area);
  auto declared = of_source(asked, area, trust);
  if (!declared) return declared.problem();
  if (*declared) return std::move(**declared);
  return of_known(*known(kDefaultDatum), "default", area, trust);
}

}  // namespace cordillera::raster
