#include "raster/place/grid_names.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include "proto/letters.h"

namespace cordillera::raster {

std::string published_datum(std::string_view file) {
  static constexpr std::pair<std::string_view, const char*> kPublished[] = {
      {"egm96_15.gtx", "EGM96"},   {"us_nga_egm96_15.tif", "EGM96"},   {"egm96-15.pgm", "EGM96"},
      {"egm08_25.gtx", "EGM2008"}, {"us_nga_egm08_25.tif", "EGM2008"}, {"us_nga_egm84_30.tif", "EGM84"}};
  const auto* const found =
      std::find_if(std::begin(kPublished), std::end(kPublished), [&](const auto& one) { return one.first == file; });
  return found == std::end(kPublished) ? "" : found->second;
}

std::string name_of_grid(std::string_view grid) {
  constexpr const char* kDatums[] = {"ellipsoid", "EGM96", "EGM2008", "EGM84", "EGM96 height", "EGM2008 height", "EGM84 height"};
  const std::string file = std::filesystem::path(grid).filename().string();
  const bool datum =
      std::any_of(std::begin(kDatums), std::end(kDatums), [&](const char* one) { return proto::same_letters(one, file); });
  return (datum ? "grid file " : "") + file;
}

}  // namespace cordillera::raster
