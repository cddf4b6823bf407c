#include "raster/photo/photo_bands.h"

#include <algorithm>
#include <cmath>

#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr int kMask = 4;               // beside the colours, 0 to 2, and the alpha band, 3
constexpr int kMostSide = 2048;        // of what is read of the file at once
constexpr int kGreatestFactor = 2048;  // one block of it is just that
constexpr double kAlmost = 1 + 1e-6;   // overviews have whole pixels, so their scale is no round number

constexpr const char* kColourBands = "bands of bytes that are red, green and blue, with or without alpha";

std::size_t pixel_at(int row, int column, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// Of the part of a block that the pixels have.
void put_mean(const std::vector<std::uint8_t>& rgba, const PhotoWindow& pixels, const PhotoWindow& block, std::uint8_t* out) {
  std::uint64_t sum[4] = {}, count = 0;
  for (int r = block.y; r < std::min(block.y + block.rows, pixels.rows); ++r) {
    for (int c = block.x; c < std::min(block.x + block.columns, pixels.columns); ++c, ++count) {
      const std::uint8_t* const p = &rgba[4 * pixel_at(r, c, pixels.columns)];
      for (int k = 0; k < 3; ++k) sum[k] += std::uint64_t{p[k]} * p[3];
      sum[3] += p[3];
    }
  }
  if (sum[3] == 0) return;
  for (int k = 0; k < 3; ++k) out[k] = static_cast<std::uint8_t>((sum[k] + sum[3] / 2) / sum[3]);
  out[3] = static_cast<std::uint8_t>((sum[3] + count / 2) / count);
}

int band_of_colour(GDALDataset& file, GDALColorInterp colour) {
  for (int k = 1; k <= file.GetRasterCount(); ++k)
    if (file.GetRasterBand(k)->GetColorInterpretation() == colour) return k;
  return 0;
}

}  // namespace

proto::Result<PhotoBands> PhotoBands::of(const Dataset& dataset) {
  PhotoBands bands;
  if (const auto chosen = bands.choose(dataset); !chosen.ok()) return chosen.problem();
  return bands;
}

/// By what the bands say they are, else the first three.
proto::Result<void> PhotoBands::choose(const Dataset& dataset) {
  GDALDataset& file = *dataset.handle;
  const int bands = file.GetRasterCount();
  if (file.GetRasterBand(1)->GetColorTable() != nullptr)
    return Problem{"raster-bands", dataset.name + " has a colour table, and no bands that are red, green and blue",
                   std::string(kColourBands) + ": gdal_translate -expand rgb makes them", ""};
  colours_ = {band_of_colour(file, GCI_RedBand), band_of_colour(file, GCI_GreenBand), band_of_colour(file, GCI_BlueBand)};
  if (std::count(colours_.begin(), colours_.end(), 0) > 0 && bands >= 3) colours_ = {1, 2, 3};
  if (std::count(colours_.begin(), colours_.end(), 0) > 0)
    return Problem{"raster-bands",
                   dataset.name + " has " + (bands == 1 ? "one band" : std::to_string(bands) + " bands") +
                       ", and none that are red, green and blue",
                   kColourBands, ""};
  for (const int number : colours_) {
    const GDALDataType type = file.GetRasterBand(number)->GetRasterDataType();
    if (type == GDT_Byte) continue;
    return Problem{"raster-type", dataset.name + " has colours of type " + GDALGetDataTypeName(type),
                   std::string(kColourBands) + ": gdal_translate -ot Byte -scale makes them", ""};
  }
  alpha_ = band_of_colour(file, GCI_AlphaBand);
  if (std::count(colours_.begin(), colours_.end(), alpha_) > 0) alpha_ = 0;
  if (alpha_ != 0) return {};
  masked_ = (file.GetRasterBand(colours_[0])->GetMaskFlags() & GMF_PER_DATASET) != 0;
  std::array<double, 3> nodata{};
  int all = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    int has = 0;
    nodata[k] = file.GetRasterBand(colours_[k])->GetNoDataValue(&has);
    all &= has;
  }
  if (all != 0 && !masked_) nodata_ = nodata;
  return {};
}

/// which: 0 to 2 a colour, 3 alpha, kMask. Null: there is none.
GDALRasterBand* PhotoBands::band(const Dataset& dataset, int which, int overview) const {
  const auto at = [&](int number) {
    GDALRasterBand* const full = dataset.handle->GetRasterBand(number);
    return overview < 0 ? full : overview < full->GetOverviewCount() ? full->GetOverview(overview) : nullptr;
  };
  if (which == 3) return alpha_ == 0 ? nullptr : at(alpha_);
  if (which != kMask) return at(colours_[static_cast<std::size_t>(which)]);
  GDALRasterBand* const red = at(colours_[0]);
  return masked_ && red != nullptr && (red->GetMaskFlags() & GMF_PER_DATASET) != 0 ? red->GetMaskBand() : nullptr;
}

/// Of every band, and of the mask.
bool PhotoBands::has_overview(const Dataset& dataset, int overview) const {
  for (int which = 0; which < 3; ++which)
    if (band(dataset, which, overview) == nullptr) return false;
  return (alpha_ == 0 || band(dataset, 3, overview) != nullptr) && (!masked_ || band(dataset, kMask, overview) != nullptr);
}

PhotoLayer PhotoBands::layer(const Dataset& dataset, double pixels_x, double pixels_y) const {
  const GdalScope scope(dataset.trust);
  double step_x = 1, step_y = 1;
  PhotoLayer out;
  out.columns = dataset.columns;
  out.rows = dataset.rows;
  const int overviews = dataset.handle->GetRasterBand(colours_[0])->GetOverviewCount();
  for (int k = 0; k < overviews; ++k) {
    if (!has_overview(dataset, k)) continue;
    GDALRasterBand* const red = band(dataset, 0, k);
    const double x = static_cast<double>(dataset.columns) / red->GetXSize(),
                 y = static_cast<double>(dataset.rows) / red->GetYSize();
    if (x > pixels_x * kAlmost || y > pixels_y * kAlmost || x <= step_x) continue;
    out.overview = k;
    out.columns = red->GetXSize();
    out.rows = red->GetYSize();
    step_x = x;
    step_y = y;
  }
  const double rest = std::min(pixels_x / step_x, pixels_y / step_y);
  out.factor = static_cast<int>(std::clamp(std::floor(rest * kAlmost), 1.0, static_cast<double>(kGreatestFactor)));
  out.scale_x = 1 / (step_x * out.factor);
  out.scale_y = 1 / (step_y * out.factor);
  out.columns = (out.columns + out.factor - 1) / out.factor;
  out.rows = (out.rows + out.factor - 1) / out.factor;
  return out;
}

/// part: of the overview. Alpha is 255 where nothing says that there is no colour.
proto::Result<void> PhotoBands::read_pixels(const Dataset& dataset, int overview, const PhotoWindow& part,
                                            std::vector<std::uint8_t>& rgba) const {
  const std::size_t pixels = static_cast<std::size_t>(part.columns) * static_cast<std::size_t>(part.rows);
  rgba.assign(4 * pixels, 255);
  const GdalScope scope(dataset.trust);
  for (int which = 0; which < 4; ++which) {
    GDALRasterBand* const from = band(dataset, which == 3 && alpha_ == 0 ? kMask : which, overview);
    if (from == nullptr) continue;
    if (from->RasterIO(GF_Read, part.x, part.y, part.columns, part.rows, rgba.data() + which, part.columns, part.rows, GDT_Byte,
                       4, 4 * static_cast<GSpacing>(part.columns), nullptr) == CE_None &&
        !scope.failed())
      continue;
    return unreadable_pixels(dataset, scope);
  }
  if (!nodata_) return {};
  for (std::size_t k = 0; k < pixels; ++k) {
    std::uint8_t* const p = rgba.data() + 4 * k;
    if (p[0] == (*nodata_)[0] && p[1] == (*nodata_)[1] && p[2] == (*nodata_)[2]) p[3] = 0;
  }
  return {};
}

proto::Result<std::vector<std::uint8_t>> PhotoBands::read(const Dataset& dataset, const PhotoLayer& layer,
                                                          const PhotoWindow& window) const {
  const GdalScope scope(dataset.trust);
  const int f = layer.factor;
  GDALRasterBand* const red = band(dataset, 0, layer.overview);
  std::vector<std::uint8_t> out(4 * pixel_at(window.rows, 0, window.columns)), part;
  const int side = std::max(1, kMostSide / f);  // blocks that are read at once
  for (int r0 = 0; r0 < window.rows; r0 += side) {
    for (int c0 = 0; c0 < window.columns; c0 += side) {
      const int columns = std::min(side, window.columns - c0), rows = std::min(side, window.rows - r0);
      const int x = (window.x + c0) * f, y = (window.y + r0) * f;
      const PhotoWindow from{x, y, std::min(columns * f, red->GetXSize() - x), std::min(rows * f, red->GetYSize() - y)};
      if (const auto done = read_pixels(dataset, layer.overview, from, part); !done.ok()) return done.problem();
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c)
          put_mean(part, from, {c * f, r * f, f, f}, &out[4 * pixel_at(r0 + r, c0 + c, window.columns)]);
      }
    }
  }
  return out;
}

}  // namespace cordillera::raster
