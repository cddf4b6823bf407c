#pragma once
// Which surface the source's heights count from, and the geoid that takes them to the ellipsoid.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "proto/result.h"
#include "raster/geoid.h"
#include "raster/source.h"

namespace cordillera::raster {

/// What heights are taken to count from when neither the request nor the file says.
inline constexpr const char* kDefaultDatum = "EGM96";

struct VerticalDatum {
  std::string name;              ///< EGM96, EGM2008, EGM84, ellipsoid, or the grid's file name
  std::string from;              ///< "request", "source" or "default"
  std::unique_ptr<Geoid> geoid;  ///< null: heights are ellipsoidal already
};

/// Folders and files that grids are read from: for who decides what this process may read.
std::vector<std::filesystem::path> geoid_places();

/// requested: vertical_datum= of the request. declared: what the CRS says; a datum without a geoid of ours counts as none.
proto::Result<VerticalDatum> resolve_vertical(const std::string& requested, const std::string& declared, Trust trust, const Area& area);

}  // namespace cordillera::raster
