#pragma once
// A digital elevation model as one function: lattice vertex -> ellipsoidal height. The only floor that knows GDAL and
// GeographicLib.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cordillera.pb.h"
#include "proto/lattice.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::raster {

struct Decimation;
class SharedPixels;

/// A pixel's centre on a lattice, in columns and rows from a vertex that is agreed upon, and its height in metres above the
/// ellipsoid.
struct PixelPoint {
  double x = 0, y = 0;
  double height_m = 0;
};

/// What a source's description says of nodata where a sparse GeoTIFF declares none: blocks that it never stored are voids. So is
/// what no source of a VRT covers.
inline constexpr const char* kUnstoredBlocks = "unstored blocks";

/// Whether the file may point at other files (VRT, sidecars, archives): yes from the command line, no over HTTP.
enum class Trust { operator_file, posted_file };

class Source {
 public:
  virtual ~Source() = default;

  /// What was read and what was assumed; bbox, sizes, datum. nodata_share, heights and error_at_pixels are left to the caller.
  virtual const proto::Source& description() const = 0;

  /// Rectangle of lattice vertices that can be valid: west <= east, south <= north, inclusive; east may exceed the circle
  /// (data over the antimeridian). Never cuts off a valid vertex.
  struct Window {
    std::int64_t west = 0, south = 0, east = 0, north = 0;
  };
  virtual Window window(const proto::Lattice& lattice) const = 0;

  /// Whether all vertices of the rectangle are certainly void, told cheaply: it lies outside the window, or over blocks that a
  /// sparse file never stored, or gaps of a VRT. False means: sample to know.
  virtual bool empty(const proto::Lattice&, std::int64_t /*west*/, std::int64_t /*south*/, std::int64_t /*columns*/,
                     std::int64_t /*rows*/) const {
    return false;
  }

  /// Heights at columns*rows lattice vertices from (west, south). A vertex's height never depends on the window that asked.
  /// Columns are taken modulo the circle. Memory is bounded by the window, not by the raster. Not thread-safe: one Source a
  /// thread.
  virtual proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south,
                                               std::int32_t columns, std::int32_t rows) = 0;

  /// What the source says at places, before any geoid: the height of the pixel that holds the place (unit, scale and nodata rule
  /// applied), NaN where there is none. Nothing is interpolated, so equal values stay equal. out: one a place; longitudes in any
  /// turn. As sample(): not thread-safe, and a place's value never depends on what else was asked.
  virtual proto::Result<void> nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg, double* out);

  /// The same at the middles of the cells between the window's vertices, by rows from the south: of so many places that they are
  /// found as those of samples are, to a thousandth of a pixel.
  virtual proto::Result<void> nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out);

  /// The source's own pixels whose centres lie in the cells between the window's vertices, its southern and western sides
  /// included (and the northern one at the pole), in the source's order: places from the window's south-western vertex, heights
  /// as in sample(). Voids are left out. Memory is bounded by the window. A source that has no pixels of its own has none. As
  /// sample(): not thread-safe.
  virtual proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice&, const Window& /*cells*/) {
    return std::vector<PixelPoint>();
  }

  /// At most about so many of its pixels, for open_decimated(); null: a source that is no single raster has none. Problems:
  /// decimation.h.
  virtual proto::Result<std::shared_ptr<const Decimation>> decimate(std::int64_t /*most_pixels*/) {
    return std::shared_ptr<const Decimation>();
  }

  /// What this handle reads is shared with others on the same raster from now on; raster: its number among those that share. A
  /// mosaic numbers its rasters itself.
  virtual void share_pixels(const std::shared_ptr<SharedPixels>&, std::size_t /*raster*/) {}

  /// Undulations at a few places of the data as text: two machines whose texts differ would make different tiles.
  virtual std::string datum_print() const { return ""; }
};

/// Samples of a rectangle in which there is no data.
inline proto::Samples void_samples(const Source::Window& w) {
  proto::Samples samples{
      w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1), static_cast<std::int32_t>(w.north - w.south + 1), {}, {}};
  const std::size_t count = static_cast<std::size_t>(samples.columns) * static_cast<std::size_t>(samples.rows);
  samples.height.assign(count, proto::kNoHeight);
  samples.flat_water.assign(count, 0);
  return samples;
}

/// path: the file. name: what the user called it; an .hgt knows its place only by that. Options used: band, crs, vertical_datum,
/// nodata, voids (a height; what is to be filled is void here, see filled_source.h), z_scale, z_offset, bbox. Errors name the
/// file or option, what is wrong, and what would be accepted.
proto::Result<std::unique_ptr<Source>> open_source(const std::string& path, const std::string& name, Trust trust,
                                                   const proto::BuildOptions& options);

/// The same as a build of this raster alone reads it: voids that data encloses are filled, and then its samples are moved to its
/// pixels, as options (voids, fill_limit, pixels) ask. open_source moves them, too, but fills nothing: among several rasters
/// another one may have data there.
proto::Result<std::unique_ptr<Source>> open_filled_source(const std::string& path, const std::string& name, Trust trust,
                                                          const proto::BuildOptions& options);

/// As open_source, of the raster that the pixels were taken from.
proto::Result<std::unique_ptr<Source>> open_decimated(const std::string& path, const std::string& name, Trust trust,
                                                      const proto::BuildOptions& options,
                                                      const std::shared_ptr<const Decimation>& pixels);

}  // namespace cordillera::raster
