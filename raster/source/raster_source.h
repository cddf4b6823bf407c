#pragma once
// The Source of this floor: a dataset, its place, its kernel and its geoid.
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "proto/integers.h"
#include "raster/datum/vertical.h"
#include "raster/open/dataset.h"
#include "raster/pixels/pixels.h"
#include "raster/place/footprint.h"
#include "raster/place/patch.h"
#include "raster/place/placement.h"
#include "raster/sample/kernel.h"
#include "raster/source.h"
#include "raster/source/options.h"

namespace cordillera::raster {

/// What open_source found out; each part checked.
struct SourceParts {
  Dataset dataset;
  std::optional<Placement> placement;
  HeightRule height_rule;
  VerticalDatum datum;
  SourceOptions options;
  Area area;  ///< safe footprint, clipped to the bbox
  bool full_circle = false;
  bool point = false;             ///< data reaches from centre to centre only
  double pole_longitude_deg = 0;  ///< where a pole row is sampled: it is one point
  proto::Source description;
};

/// Pixels in memory at once (8 bytes each).
inline constexpr std::int64_t kMaxBlockPixels = 4 << 20;

using proto::modulo;

class RasterSource : public Source {
 public:
  explicit RasterSource(SourceParts parts);

  const proto::Source& description() const override { return parts_.description; }
  Window window(const proto::Lattice& lattice) const override;
  bool empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns,
             std::int64_t rows) const override;
  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override;
  proto::Result<void> nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg, double* out) override;
  proto::Result<void> nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) override;
  proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice& lattice, const Window& cells) override {
    return numbered_pixels(lattice, cells, nullptr);
  }
  /// The same. numbers: may be null; gets which pixel each of them is.
  proto::Result<std::vector<PixelPoint>> numbered_pixels(const proto::Lattice& lattice, const Window& cells,
                                                         std::vector<PixelNumber>* numbers);
  std::string datum_print() const override;
  void share_pixels(const std::shared_ptr<SharedPixels>& lately, std::size_t raster) override { pixels_.share(lately, raster); }
  proto::Result<std::shared_ptr<const Decimation>> decimate(std::int64_t most_pixels) override;

  const Placement& placement() const { return *parts_.placement; }
  PixelWindow all_pixels() const { return {0, 0, parts_.dataset.columns, parts_.dataset.rows}; }
  /// The raster's own pixels of the window, in metres above its vertical datum; NaN elsewhere.
  proto::Result<void> own_pixels(const PixelWindow& window, std::vector<double>& heights) {
    return pixels_.read(window, heights);
  }
  /// Whether pixels without data are voids from now on, or have the height of voids=, as they have at first where it is one.
  void set_voids(VoidRule voids) {
    voids_ = parts_.height_rule.voids == VoidRule::value ? voids : VoidRule::hole;
    pixels_.set_voids(voids_);
  }
  VoidRule voids() const { return voids_; }
  /// Fills pixels of the window that lie beyond the raster's sides, where others of the same grid have them. The raster's
  /// outermost half pixels are then interpolated to these. It reaches no farther than before; one of points does, up to theirs.
  using Beyond = std::function<proto::Result<void>(const PixelWindow& window, std::vector<double>& heights)>;
  void set_beyond(Beyond beyond);

 private:
  /// A rectangle of the samples asked for.
  struct Rect {
    std::int32_t c0, r0, columns, rows;
  };
  struct Call;  ///< one call of sample()
  /// The rectangle of the asked vertices that holds those of window(), and so many around them; all of them where the raster lies
  /// over both ends of a window around the earth.
  Window part_with_data(const proto::Lattice& lattice, const Window& asked, std::int64_t around) const;
  /// sample() without asking first whether anything is there.
  proto::Result<proto::Samples> sample_present(const proto::Lattice& lattice, std::int64_t west, std::int64_t south,
                                               std::int32_t columns, std::int32_t rows);
  double undulation_m(double latitude_deg, double longitude_deg) const;
  /// Undulations at the vertices of a rectangle, and between them.
  struct UndulationGrid {
    int level = -1;  ///< of the lattice
    std::int64_t west = 0, south = 0, columns = 0;
    std::vector<double> at_m;  ///< by rows from the south
    /// Those of undulations_m, or null where it does not hold all of them.
    const double* row(const proto::Lattice& lattice, std::int64_t i, std::int64_t j, std::int32_t count) const;
    /// x and y from the south-western vertex, 0 or more.
    double operator()(double x, double y) const {
      const auto left = static_cast<std::int64_t>(x), below = static_cast<std::int64_t>(y);
      const double fx = x - static_cast<double>(left), fy = y - static_cast<double>(below);
      const auto k = static_cast<std::size_t>(below * columns + left);
      const double lower = at_m[k] + fx * (at_m[k + 1] - at_m[k]);
      const auto up = k + static_cast<std::size_t>(columns);
      const double upper = at_m[up] + fx * (at_m[up + 1] - at_m[up]);
      return lower + fy * (upper - lower);
    }
  };
  /// Into known_undulations_: of the vertices around the cells, and one more to the east and the north, for what lies on the rim.
  void see_undulations(const proto::Lattice& lattice, const Window& cells);
  /// Of count vertices of row j, from column i eastward; 0 when the source's heights are ellipsoidal.
  const double* undulations_m(const proto::Lattice& lattice, std::int64_t i, std::int64_t j, std::int32_t count);
  /// Fills samples where nothing but lines of pixels is needed; false: sample by sample.
  std::vector<double> column_places(const proto::Lattice& lattice, const Kernel& kernel, std::int64_t west,
                                    std::int32_t columns) const;
  std::vector<double> row_places(const proto::Lattice& lattice, const Kernel& kernel, std::int64_t south,
                                 std::int64_t north) const;
  proto::Result<bool> sample_lines(const proto::Lattice& lattice, const Kernel& kernel, proto::Samples& samples);
  std::vector<PixelWindow> pixels_around(const proto::Lattice& lattice, const Window& cells) const;
  const KernelFrame& frame_for(const proto::Lattice& lattice);
  /// Into block_: what the kernel reads.
  proto::Result<void> read_block();
  void place_samples(Call& call);
  proto::Result<void> resample(Call& call, const Rect& rect);
  proto::Result<void> resample_wide(Call& call, std::size_t at);
  /// The pixel that holds a place.
  struct PixelPlace {
    std::int64_t x = 0, y = 0;
  };
  /// Nowhere, unless the raster has both of them.
  static PixelPlace place_of(std::int64_t column, std::int64_t row);
  std::int64_t pixel_column(double x) const;
  std::int64_t pixel_row(double y) const;
  proto::Result<void> read_nearest(std::span<const PixelPlace> places, double* out);

  SourceParts parts_;
  VoidRule voids_ = parts_.height_rule.voids;
  Pixels pixels_;
  Beyond beyond_;                                        ///< may be null
  PixelBlock block_;                                     ///< scratch
  std::vector<double> u_, v_;                            ///< scratch: places, indexed by sample; both NaN outside the raster
  std::vector<double> longitudes_, near_, undulations_;  ///< scratch
  UndulationGrid known_undulations_;  ///< of the pixels asked for last: samples of that place are asked for next
  patch::KnownPatches vertex_patches_, pixel_patches_;
  std::optional<KernelFrame> frame_;  ///< of frame_level_
  int frame_level_ = -1;
};

}  // namespace cordillera::raster
