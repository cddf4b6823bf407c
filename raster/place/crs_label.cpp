#include "raster/place/crs_label.h"

#include <cpl_conv.h>

#include <algorithm>
#include <sstream>

#include "proto/letters.h"
#include "proto/utf8.h"

namespace cordillera::raster {
namespace {

/// What drivers write where there is no name: "unnamed", "unknown", "Unknown based on WGS 84 ellipsoid", "undefined", …
bool names_nothing(std::string name) {
  name = proto::lower(name);
  if (name.empty()) return true;
  const auto starts = [&](const char* word) { return name.rfind(word, 0) == 0; };
  return starts("unnamed") || starts("unknown") || starts("undefined") || starts("user-defined") || starts("user defined");
}

/// The parameters, without those that say nothing about the place.
std::string proj_text(const OGRSpatialReference& srs) {
  char* text = nullptr;
  if (srs.exportToProj4(&text) != OGRERR_NONE) {
    CPLFree(text);
    return "";
  }
  std::istringstream words(text_of(text));
  CPLFree(text);
  std::string out;
  for (std::string word; words >> word;) {
    if (word != "+no_defs" && word != "+type=crs" && word != "+wktext") out += (out.empty() ? "" : " ") + word;
  }
  return out;
}

/// The first of geographic CRS, datum and ellipsoid that has a name.
std::string base_of(const OGRSpatialReference& srs) {
  for (const char* node : {"GEOGCS", "DATUM", "SPHEROID"}) {
    std::string name = text_of(srs.GetAttrValue(node));
    std::replace(name.begin(), name.end(), '_', ' ');
    if (!names_nothing(name)) return name;
  }
  return "an ellipsoid of its own";
}

std::string description_of(const OGRSpatialReference& srs) {
  std::string method = text_of(srs.GetAttrValue("PROJECTION"));
  std::replace(method.begin(), method.end(), '_', ' ');
  if (method.empty()) method = srs.IsGeographic() ? "degrees" : srs.IsProjected() ? "a projection" : "unnamed";
  std::string label = method + " on " + base_of(srs);
  const std::string parameters = proj_text(srs);
  if (!parameters.empty()) label += " (" + parameters + ")";
  return label;
}

}  // namespace

std::string crs_label(const OGRSpatialReference& srs) {
  const std::string authority = text_of(srs.GetAuthorityName(nullptr)), code = text_of(srs.GetAuthorityCode(nullptr));
  const std::string name = text_of(srs.GetName());
  const std::string label = proto::shown_text(names_nothing(name) ? description_of(srs) : name);  // WKT can be pages
  return authority.empty() || code.empty() ? label : label + proto::shown_text(" (" + authority + ":" + code + ")");
}

}  // namespace cordillera::raster
