#include "raster/photo/orthophoto.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>

#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/open/dataset.h"
#include "raster/photo/photo_bands.h"
#include "raster/place/crs.h"
#include "raster/place/footprint.h"
#include "raster/place/lattice_places.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr const char* kAnyPhoto =
    "an orthophoto that GDAL reads, such as a GeoTIFF; of a picture with a world file, gdal_translate -a_srs makes one";
constexpr std::int64_t kMostLayerPixels = 16 << 20;  // four bytes each
constexpr double kRim_px = 1e-6;                     // what lies so near beside the rim lies on it

/// A rectangle of the vertices asked for.
struct VertexRect {
  std::int32_t column = 0, row = 0, columns = 0, rows = 0;
};

/// A place in a layer, in pixels from the middle of the first; not a number where the photo does not reach.
struct LayerPlace {
  double u = 0, v = 0;
};

/// Weights of pixels along an axis: a triangle about the place. The outermost pixels reach to the rim.
struct AxisWeights {
  AxisWeights(double at, double half, int pixels) : first(std::max(0, static_cast<int>(std::floor(at - half)) + 1)) {
    for (int k = first; k < pixels && k < at + half; ++k) of.push_back(1 - std::abs(k - at) / half);
  }
  int first;
  std::vector<double> of;
};

class Photo : public Orthophoto {
 public:
  Photo(Dataset dataset, const PhotoBands& bands, Placement placement)
      : dataset_(std::move(dataset)), bands_(bands), placement_(std::move(placement)) {
    const Footprint print =
        footprint(placement_, {0, 0, static_cast<double>(dataset_.columns), static_cast<double>(dataset_.rows)});
    area_ = print.safe;
    full_circle_ = print.full_circle;
  }

  const Area& area() const override { return area_; }
  const std::string& name() const override { return dataset_.name; }
  proto::Result<std::optional<std::vector<std::uint8_t>>> colours(const proto::Lattice& lattice,
                                                                  const VertexWindow& window) override;

 private:
  struct Call;
  bool reaches(const proto::Lattice& lattice, std::int64_t column) const;
  void row(LatticePlaces& places, const proto::Lattice& lattice, std::int64_t west, std::int64_t j, std::vector<double>& x,
           std::vector<double>& y) const;
  void place(Call& call) const;
  PhotoWindow pixels_under(const Call& call, const VertexRect& rect) const;
  void mix(Call& call, std::size_t at, const PhotoWindow& part, const std::vector<std::uint8_t>& pixels) const;
  proto::Result<void> draw(Call& call, const VertexRect& rect) const;

  Dataset dataset_;
  PhotoBands bands_;
  Placement placement_;
  Area area_;
  bool full_circle_ = false;
  std::mutex mutex_;  // of the dataset and the placement
};

struct Photo::Call {
  const proto::Lattice& lattice;
  const VertexWindow& window;
  PhotoLayer layer;
  std::unique_lock<std::mutex>& of_dataset;  ///< and of its placement; held but while colours are mixed
  double half_x = 1, half_y = 1;             ///< of the triangles, in the layer's pixels
  std::vector<LayerPlace> places;            ///< by row from the north, then column
  std::vector<std::uint8_t> rgba;
  bool any = false;

  std::size_t index(std::int32_t row, std::int32_t column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(window.columns) + static_cast<std::size_t>(column);
  }
};

bool Photo::reaches(const proto::Lattice& lattice, std::int64_t column) const {
  if (full_circle_) return true;
  const double east_of = lattice.longitude_deg(column) - area_.west_deg;
  return east_of - 360 * std::floor(east_of / 360) <= area_.east_deg - area_.west_deg;
}

/// Pixel coordinates of a row of vertices.
void Photo::row(LatticePlaces& places, const proto::Lattice& lattice, std::int64_t west, std::int64_t j, std::vector<double>& x,
                std::vector<double>& y) const {
  if (j != 0 && j != lattice.rows()) return places.row(j, x.data(), y.data());
  for (std::size_t k = 0; k < x.size(); ++k) x[k] = lattice.longitude_deg(west + static_cast<std::int64_t>(k));
  std::fill(y.begin(), y.end(), lattice.latitude_deg(j));
  placement_.to_pixels(x.data(), y.data(), x.size());
}

void Photo::place(Call& call) const {
  constexpr double kBeside = std::numeric_limits<double>::quiet_NaN();
  const auto& [west, south, columns, rows] = call.window;
  call.places.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), {kBeside, kBeside});
  std::int32_t first = 0, end = columns;
  while (first < end && !reaches(call.lattice, west + first)) ++first;
  while (end > first && !reaches(call.lattice, west + end - 1)) --end;
  if (first == end) return;
  std::vector<double> x(static_cast<std::size_t>(end - first)), y(x.size());
  patch::KnownPatches known;
  LatticePlaces places(placement_, call.lattice, west + first, end - first, known);
  const int period = placement_.period_px();
  const auto within = [](double at, int pixels) { return at >= -kRim_px && at <= pixels + kRim_px; };
  for (std::int32_t r = 0; r < rows; ++r) {
    const double latitude_deg = call.lattice.latitude_deg(south + r);
    if (latitude_deg < area_.south_deg || latitude_deg > area_.north_deg) continue;
    row(places, call.lattice, west + first, south + r, x, y);
    for (std::int32_t c = first; c < end; ++c) {
      double px = x[static_cast<std::size_t>(c - first)];
      const double py = y[static_cast<std::size_t>(c - first)];
      if (period != 0) px -= period * std::floor(px / period);
      if (!within(px, dataset_.columns) || !within(py, dataset_.rows) || !reaches(call.lattice, west + c)) continue;
      call.places[call.index(rows - 1 - r, c)] = {px * call.layer.scale_x - 0.5, py * call.layer.scale_y - 0.5};
    }
  }
}

/// The pixels that the vertices of a rectangle need; without columns where they need none.
PhotoWindow Photo::pixels_under(const Call& call, const VertexRect& rect) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double west = kFar, north = kFar, east = -kFar, south = -kFar;
  for (std::int32_t r = rect.row; r < rect.row + rect.rows; ++r) {
    for (std::int32_t c = rect.column; c < rect.column + rect.columns; ++c) {
      const auto& [u, v] = call.places[call.index(r, c)];
      if (std::isnan(u)) continue;
      west = std::min(west, u), east = std::max(east, u);
      north = std::min(north, v), south = std::max(south, v);
    }
  }
  if (west > east) return {};
  PhotoWindow part{std::max(0, static_cast<int>(west - call.half_x)), std::max(0, static_cast<int>(north - call.half_y)), 0, 0};
  part.columns = std::min(call.layer.columns, static_cast<int>(east + call.half_x) + 1) - part.x;
  part.rows = std::min(call.layer.rows, static_cast<int>(south + call.half_y) + 1) - part.y;
  return part;
}

/// Reads the layer under rect and takes means; cuts rect in two while it is too much.
proto::Result<void> Photo::draw(Call& call, const VertexRect& rect) const {
  const PhotoWindow part = pixels_under(call, rect);
  if (part.columns == 0) return {};
  if (std::int64_t{part.columns} * part.rows > kMostLayerPixels && rect.columns + rect.rows > 2) {
    VertexRect one = rect, other = rect;
    if (rect.columns >= rect.rows) {
      one.columns /= 2, other.column += one.columns, other.columns -= one.columns;
    } else {
      one.rows /= 2, other.row += one.rows, other.rows -= one.rows;
    }
    if (auto done = draw(call, one); !done.ok()) return done;
    return draw(call, other);
  }
  const auto pixels = bands_.read(dataset_, call.layer, part);
  if (!pixels.ok()) return pixels.problem();
  call.of_dataset.unlock();  // others read meanwhile
  const std::shared_ptr<void> at_the_end(nullptr, [&](void*) { call.of_dataset.lock(); });
  for (std::int32_t r = rect.row; r < rect.row + rect.rows; ++r)
    for (std::int32_t c = rect.column; c < rect.column + rect.columns; ++c) mix(call, call.index(r, c), part, *pixels);
  return {};
}

/// The colour of one vertex.
void Photo::mix(Call& call, std::size_t at, const PhotoWindow& part, const std::vector<std::uint8_t>& pixels) const {
  const auto& [u, v] = call.places[at];
  if (std::isnan(u)) return;
  const AxisWeights across(u, call.half_x, call.layer.columns), down(v, call.half_y, call.layer.rows);
  double sum[4] = {}, all = 0;
  for (std::size_t j = 0; j < down.of.size(); ++j) {
    const auto row = static_cast<std::size_t>(down.first - part.y) + j;
    const std::uint8_t* p =
        &pixels[4 * (row * static_cast<std::size_t>(part.columns) + static_cast<std::size_t>(across.first - part.x))];
    for (std::size_t i = 0; i < across.of.size(); ++i, p += 4) {
      const double weight = down.of[j] * across.of[i], shown = weight * p[3];
      for (int k = 0; k < 3; ++k) sum[k] += shown * p[k];
      sum[3] += shown;
      all += weight;
    }
  }
  const double alpha = all > 0 ? std::nearbyint(sum[3] / all) : 0;
  if (alpha == 0) return;
  call.any = true;
  for (std::size_t k = 0; k < 3; ++k) call.rgba[4 * at + k] = static_cast<std::uint8_t>(std::nearbyint(sum[k] / sum[3]));
  call.rgba[4 * at + 3] = static_cast<std::uint8_t>(alpha);
}

proto::Result<std::optional<std::vector<std::uint8_t>>> Photo::colours(const proto::Lattice& lattice,
                                                                       const VertexWindow& window) {
  using Rgba = std::vector<std::uint8_t>;
  std::unique_lock of_dataset(mutex_);
  const GdalScope scope(dataset_.trust);
  const CellSpan span = cell_span(placement_, dataset_.columns, dataset_.rows, lattice);
  Call call{lattice, window, bands_.layer(dataset_, span.x_px, span.y_px), of_dataset, 1, 1, {}, {}, false};
  call.half_x = std::max(1.0, span.x_px * call.layer.scale_x);
  call.half_y = std::max(1.0, span.y_px * call.layer.scale_y);
  place(call);
  call.rgba.assign(4 * call.places.size(), 0);
  if (auto done = draw(call, {0, 0, window.columns, window.rows}); !done.ok()) return done.problem();
  return call.any ? std::optional<Rgba>(std::move(call.rgba)) : std::optional<Rgba>();
}

proto::Result<Dataset> open_photo(const std::string& path) {
  Dataset dataset;
  dataset.path = path;
  dataset.name = std::filesystem::path(path).filename().string();
  std::error_code error;
  if (!path.starts_with("/vsi") && !std::filesystem::is_regular_file(path, error))
    return Problem{"raster-not-found", dataset.name + " does not exist or is not a file", kAnyPhoto, ""};
  const GdalScope scope(dataset.trust);
  std::vector<const char*> allowed = allowed_drivers(dataset.name, dataset.trust, false);
  allowed.insert(allowed.begin(), {"JPEG", "PNG", "WEBP", "MBTiles"});  // of pictures that are no heights
  dataset.handle.reset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, allowed.data(), nullptr, nullptr));
  if (!dataset.handle || dataset.handle->GetRasterCount() == 0) {
    const std::string said = scope.message(path, dataset.name);
    return Problem{"raster-format-unsupported",
                   dataset.name + " cannot be opened as a raster" + (said.empty() ? "" : ": " + said), kAnyPhoto, ""};
  }
  dataset.driver = dataset.handle->GetDriverName();
  dataset.columns = dataset.handle->GetRasterXSize();
  dataset.rows = dataset.handle->GetRasterYSize();
  dataset.band = dataset.handle->GetRasterBand(1);
  return dataset;
}

}  // namespace

proto::Result<std::shared_ptr<Orthophoto>> open_orthophoto(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  auto dataset = open_photo(path);
  if (!dataset.ok()) return dataset.problem();
  auto bands = PhotoBands::of(*dataset);  // before its place: a picture that is none is the greater mistake
  if (!bands.ok()) return bands.problem();
  if (auto whole = check_tiff_blocks(*dataset); !whole.ok()) return whole.problem();
  const auto crs = resolve_crs(*dataset, "");
  if (!crs.ok()) return crs.problem();
  auto placement = Placement::make(*dataset, *crs);
  if (!placement.ok()) return placement.problem();
  return std::shared_ptr<Orthophoto>(std::make_shared<Photo>(std::move(*dataset), *bands, std::move(*placement)));
}

}  // namespace cordillera::raster
