#include "raster/pixels/validity.h"

#include <cmath>

#include "proto/numbers.h"
#include "raster/pixels/short_number.h"
#include "raster/source.h"

namespace cordillera::raster {

Validity::ValueRange Validity::around(double value, GDALDataType type) {
  if (!std::isfinite(value)) return {};
  // Tags are text or double, pixels are often float32: the same number, rounded differently.
  const double slack = GDALDataTypeIsFloating(type) ? std::abs(value) * 1.2e-7 : 0;
  return {value - slack, value + slack};
}

Validity::Validity(const Dataset& dataset) {
  int has = 0;
  double nodata = dataset.band->GetNoDataValue(&has);
  const GDALDataType type = dataset.band->GetRasterDataType();
  // 64-bit integer bands answer only through functions of their own.
  if (type == GDT_Int64) nodata = static_cast<double>(dataset.band->GetNoDataValueAsInt64(&has));
  if (type == GDT_UInt64) nodata = static_cast<double>(dataset.band->GetNoDataValueAsUInt64(&has));
  if (has != 0) {
    text_ = "value " + short_number(nodata);
    declared_ = around(nodata, type);
  }
  if (dataset.driver == "netCDF") take_words_of_netcdf(dataset);
  if (dataset.asked_nodata) {
    text_ += (text_.empty() ? "value " : ", value ") + short_number(*dataset.asked_nodata) + " (request)";
    asked_ = around(*dataset.asked_nodata, type);
  }
  if (dataset.mask != nullptr) text_ += text_.empty() ? "mask band" : ", mask band";
  if (dataset.is_sparse()) text_ += text_.empty() ? kUnstoredBlocks : std::string(", ") + kUnstoredBlocks;
  if (text_.empty()) text_ = "none";
}

void Validity::take_words_of_netcdf(const Dataset& dataset) {
  const GDALDataType type = dataset.band->GetRasterDataType();
  const auto said = [&](const char* word) {
    const char* const text = dataset.band->GetMetadataItem(word);
    const auto value = text == nullptr ? std::nullopt : proto::signed_number<double>(text);
    const bool known = !value || declared_.holds(*value);
    if (!known) text_ += std::string(text_.empty() ? "" : ", ") + word + " " + short_number(*value);
    return known ? ValueRange() : around(*value, type);
  };
  missing_ = said("missing_value");
  // With a scale they may be of the unpacked values (CF 8.1), by a type that GDAL does not tell.
  if (dataset.band->GetScale() != 1 || dataset.band->GetOffset() != 0) return;
  if (const ValueRange least = said("valid_min"); !least.empty()) usual_.low = least.low;
  if (const ValueRange greatest = said("valid_max"); !greatest.empty()) usual_.high = greatest.high;
}

}  // namespace cordillera::raster
