#include "raster/vertical.h"

#include <GeographicLib/Geoid.hpp>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

#include "proto/utf8.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr const char* kAcceptedDatums = "EGM96, EGM2008, EGM84, ellipsoid, or the name of a geoid grid (GTX, GeoTIFF, GeographicLib PGM)";

struct KnownDatum {
  const char* name;
  std::vector<const char*> files;  ///< the best first
};
const std::array<KnownDatum, 3>& known_datums() {
  // EGM96: always the 15' grid, the one that every installation has; heights must not depend on what else is installed.
  static const std::array<KnownDatum, 3> known{{{"EGM96", {"egm96-15.pgm"}},
                                                {"EGM2008", {"egm2008-1.pgm", "egm2008-2_5.pgm", "egm2008-5.pgm", "us_nga_egm08_25.tif"}},
                                                {"EGM84", {"egm84-15.pgm", "egm84-30.pgm", "us_nga_egm84_30.tif"}}}};
  return known;
}

bool same_letters(const std::string& a, const std::string& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

/// The folders an operator allows: $CORDILLERA_GEOIDS (separated by ':'), then GeographicLib's own.
std::vector<fs::path> geoid_folders() {
  std::vector<fs::path> folders;
  if (const char* list = std::getenv("CORDILLERA_GEOIDS")) {
    std::istringstream parts(list);
    for (std::string folder; std::getline(parts, folder, ':');)
      if (!folder.empty()) folders.emplace_back(folder);
  }
  folders.emplace_back(GeographicLib::Geoid::DefaultGeoidPath());
  folders.emplace_back("/usr/share/proj");
  return folders;
}

std::string find_in_folders(const std::string& file) {
  std::error_code error;
  for (const fs::path& folder : geoid_folders())
    if (fs::is_regular_file(folder / file, error)) return (folder / file).string();
  return "";
}

proto::Result<std::unique_ptr<Geoid>> open_geoid(const std::string& path, const Area& area) {
  return fs::path(path).extension() == ".pgm" ? open_geoid_pgm(path, area) : open_geoid_grid(path, area);
}

proto::Result<std::unique_ptr<Geoid>> open_known(const KnownDatum& datum, const Area& area) {
  std::string files;
  for (const char* file : datum.files) {
    if (const std::string path = find_in_folders(file); !path.empty()) return open_geoid(path, area);
    files += (files.empty() ? "" : ", ") + std::string(file);
  }
  if (same_letters(datum.name, "EGM96"))
    if (const std::string path = egm96_path(); !path.empty()) return open_geoid(path, area);
  return Problem{"geoid-not-found",
                 "heights above " + std::string(datum.name) + " need a grid that is not installed: put one of " + files + " into " +
                     geoid_folders().front().string() + " or a folder named by CORDILLERA_GEOIDS",
                 kAcceptedDatums, "vertical_datum"};
}

/// A grid file that the request names. Over HTTP only a bare name, looked up in the operator's folders.
proto::Result<std::unique_ptr<Geoid>> open_named(const std::string& requested, Trust trust, const Area& area) {
  std::error_code error;
  const bool bare = requested.find_first_of("/\\") == std::string::npos;
  if (trust == Trust::operator_file && fs::is_regular_file(requested, error)) return open_geoid(requested, area);
  if (bare)
    if (const std::string path = find_in_folders(requested); !path.empty()) return open_geoid(path, area);
  return Problem{"geoid-not-found", "vertical_datum=" + proto::shown_text(requested) + " is neither a datum known here nor a grid file that may be read", kAcceptedDatums,
                 "vertical_datum"};
}

}  // namespace

std::vector<fs::path> geoid_places() {
  std::vector<fs::path> places = geoid_folders();
  if (const std::string path = egm96_path(); !path.empty()) places.emplace_back(path);
  return places;
}

proto::Result<VerticalDatum> resolve_vertical(const std::string& requested, const std::string& declared, Trust trust, const Area& area) {
  const auto known = [](const std::string& name) -> const KnownDatum* {
    for (const KnownDatum& datum : known_datums())
      if (same_letters(datum.name, name)) return &datum;
    return nullptr;
  };
  VerticalDatum datum;
  datum.name = requested;
  datum.from = "request";
  if (requested.empty()) {
    const bool usable = same_letters(declared, "ellipsoid") || known(declared) != nullptr;
    datum.name = usable ? declared : kDefaultDatum;
    datum.from = usable ? "source" : "default";
  }
  if (same_letters(datum.name, "ellipsoid")) {
    datum.name = "ellipsoid";
    return datum;
  }
  const KnownDatum* by_name = known(datum.name);
  auto geoid = by_name != nullptr ? open_known(*by_name, area) : open_named(datum.name, trust, area);
  if (!geoid) return geoid.problem();
  datum.geoid = std::move(*geoid);
  datum.name = by_name != nullptr ? by_name->name : fs::path(datum.name).filename().string();
  return datum;
}

}  // namespace cordillera::raster
