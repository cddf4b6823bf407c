#pragma once
// Which surface the source's heights count from, and the geoid that takes them to the ellipsoid.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "raster/datum/geoid.h"
#include "raster/datum/vertical_crs.h"
#include "raster/source.h"

namespace cordillera::raster {

/// What heights are taken to count from when neither the request nor the file says.
inline constexpr const char* kDefaultDatum = "EGM96";

struct VerticalDatum {
  std::string name;              ///< EGM96, EGM2008, EGM84, ellipsoid, a height system's name, or name_of_grid
  std::string from;              ///< "request", "source" or "default"
  std::string grid;              ///< of a height system: what PROJ takes
  std::unique_ptr<Geoid> geoid;  ///< null: heights are ellipsoidal already
};

/// Folders and files that grids are read from: for who decides what this process may read.
std::vector<std::filesystem::path> geoid_places();

/// The height system that vertical_datum= of a request names, such as EPSG:6360; nullopt: none, but a geoid, a grid or the
/// ellipsoid, or nothing that is known.
std::optional<VerticalCrs> system_named(const std::string& requested, Trust trust);

struct VerticalAsked {
  std::string requested{};              ///< vertical_datum= of the request; overrules what the raster declares
  std::string declared{};               ///< by the CRS: a name of known_datum, or the height system's own
  std::string geoid_grids{};            ///< that the CRS names for its heights: Crs::geoid_grids
  std::string compound_wkt{};           ///< the CRS that declares it
  std::string base_wkt{};               ///< the horizontal CRS
  std::optional<VerticalCrs> system{};  ///< system_named(requested)
  double system_z_scale = 1;            ///< z_scale= that says the unit and direction, too, which the raster has from it
};

/// What is declared and PROJ cannot take to the ellipsoid by any means counts as not declared. A grid that is only not installed
/// is a problem, as is one that the CRS names and that is not at hand.
proto::Result<VerticalDatum> resolve_vertical(const VerticalAsked& asked, Trust trust, const Area& area);

}  // namespace cordillera::raster
