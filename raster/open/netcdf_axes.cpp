#include "raster/open/netcdf_axes.h"

#include <gdal_priv.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "proto/utf8.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// Of NetCDF GDAL takes the last dimension of a variable for columns, whatever it is: longitudes down the rows would put the
/// raster elsewhere on the earth, and without a word.
std::optional<Problem> turned(const Dataset& dataset, const std::string& variable, const GDALMDArray& array) {
  const auto& dimensions = array.GetDimensions();
  const std::size_t last = dimensions.size() - 1;
  if (dimensions[last]->GetType() != GDAL_DIM_TYPE_HORIZONTAL_Y || dimensions[last - 1]->GetType() != GDAL_DIM_TYPE_HORIZONTAL_X)
    return std::nullopt;
  std::string order;
  for (std::size_t k = 0; k < dimensions.size(); ++k)
    order += std::to_string(k + 1 == last ? last : k == last ? last - 1 : k) + (k == last ? "" : ",");
  return Problem{
      "raster-not-georeferenced", "in " + dataset.name + " the rows of " + variable + " are meridians: it is turned",
      "rows of equal latitude: `gdalmdimtranslate in.nc out.nc -array name=" + variable + ",transpose=[" + order + "]` turns it",
      ""};
}

/// Coordinates along a dimension. None: there are none, or too few to be uneven.
std::vector<double> coordinates_along(const GDALDimension& dimension) {
  const auto variable = dimension.GetIndexingVariable();
  const std::size_t count = static_cast<std::size_t>(dimension.GetSize());
  if (!variable || variable->GetDimensionCount() != 1 || count < 3) return {};
  std::vector<double> places(count);
  const GUInt64 from = 0;
  if (!variable->Read(&from, &count, nullptr, nullptr, GDALExtendedDataType::Create(GDT_Float64), places.data())) return {};
  constexpr double kCircle = 360;  // longitudes may begin again
  for (std::size_t k = 1; k < count && variable->GetUnit().starts_with("degree"); ++k)
    places[k] -= kCircle * std::round((places[k] - places[k - 1]) / kCircle);
  return places;
}

/// How far the farthest coordinate is from where even steps would put it, in steps.
double unevenness(const std::vector<double>& places) {
  const double step = (places.back() - places.front()) / static_cast<double>(places.size() - 1);
  double farthest = 0;
  for (std::size_t k = 0; k < places.size(); ++k)
    farthest = std::max(farthest, std::abs(places[k] - places.front() - static_cast<double>(k) * step));
  return farthest / std::abs(step);
}

/// What a coordinate loses as a float32, in steps; some files have no more.
double rounding_of(const std::vector<double>& places) {
  const double greatest = std::max(std::abs(places.front()), std::abs(places.back()));
  return greatest * FLT_EPSILON * static_cast<double>(places.size() - 1) / std::abs(places.back() - places.front());
}

std::optional<Problem> uneven(const Dataset& dataset, const std::string& variable, const GDALDimension& dimension) {
  constexpr double kMostUneven_px = 0.1;
  const std::vector<double> places = coordinates_along(dimension);
  if (places.empty() || !(unevenness(places) > kMostUneven_px + rounding_of(places))) return std::nullopt;
  char far_off[32] = "";
  std::snprintf(far_off, sizeof far_off, "%.3g", unevenness(places));
  return Problem{"raster-not-georeferenced",
                 "in " + dataset.name + " the coordinates " + proto::shown_text(dimension.GetName()) + " of " + variable +
                     " are not evenly spaced: they are up to " + far_off + " steps from where even steps would put them",
                 "a grid of even steps; `cdo remapbil,GRID in.nc out.nc` makes one of it", ""};
}

}  // namespace

proto::Result<void> check_netcdf_axes(const Dataset& dataset) {
  std::error_code error;
  if (dataset.driver != "netCDF" || !fs::is_regular_file(dataset.path, error)) return {};
  const char* const name = dataset.handle->GetRasterBand(1)->GetMetadataItem("NETCDF_VARNAME");
  const char* const only[] = {"netCDF", nullptr};
  const GDALDatasetUniquePtr whole(
      GDALDataset::Open(dataset.path.c_str(), GDAL_OF_MULTIDIM_RASTER | GDAL_OF_READONLY, only, nullptr, nullptr));
  const auto root = whole && name != nullptr ? whole->GetRootGroup() : nullptr;
  const auto array = root ? root->OpenMDArray(name) : nullptr;
  if (!array || array->GetDimensionCount() < 2) return {};
  const std::string variable = proto::shown_text(name);
  if (auto refused = turned(dataset, variable, *array)) return *refused;
  const auto& dimensions = array->GetDimensions();
  for (std::size_t k = dimensions.size() - 2; k < dimensions.size(); ++k)
    if (auto refused = uneven(dataset, variable, *dimensions[k])) return *refused;
  return {};
}

}  // namespace cordillera::raster
