#pragma once
// What a raster's coordinates mean: its horizontal CRS alone, and what it declares about heights.
#include <ogr_spatialref.h>

#include <string>

#include "proto/result.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {

struct Crs {
  OGRSpatialReference horizontal;  ///< 2D; traditional axis order (x = east or longitude)
  std::string horizontal_wkt;      ///< the same as text
  std::string label;               ///< as crs_label says it
  std::string from;                ///< "source" or "request"
  std::string declared_datum;  ///< EGM96, EGM2008, EGM84, ellipsoid, names of geoid_grids, another vertical CRS's name, or empty
  std::string geoid_grids;     ///< files that the CRS names for its heights, as PROJ writes them: "@a.gtx,b.gtx"; mostly empty
  std::string compound_wkt;    ///< the compound CRS that declares it; empty when none does
  std::string vertical_from;   ///< who declared it: "source" or "request"
  std::string height_unit;     ///< of the vertical axis; empty when none is declared
  double height_unit_m = 0;    ///< its length, whatever its name; 0: not stated
  bool depth = false;          ///< the vertical axis points down
};

/// The raster's own CRS, else the one that the request names; what the raster does not say about heights, the request's CRS may.
/// Compound and 3D systems are taken apart, so that a horizontal transformation cannot shift heights behind our back.
proto::Result<Crs> resolve_crs(const Dataset& dataset, const std::string& requested);

/// A CRS given in a request or by a stranger's file is a definition, never a file or an address to fetch.
inline constexpr const char* kSealedCrs[] = {"ALLOW_NETWORK_ACCESS=NO", "ALLOW_FILE_ACCESS=NO", nullptr};

/// As WKT 2; empty when it cannot be written.
std::string wkt_of(const OGRSpatialReference& srs);

}  // namespace cordillera::raster
