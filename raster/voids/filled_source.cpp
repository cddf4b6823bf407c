#include "raster/voids/filled_source.h"

#include <algorithm>
#include <optional>

#include "proto/mesh.h"
#include "raster/voids/void_map.h"

namespace cordillera::raster {
namespace {

class FilledSource final : public Source {
 public:
  FilledSource(std::unique_ptr<Source> source, std::uint32_t limit_cells)
      : source_(std::move(source)), limit_cells_(limit_cells) {}

  const proto::Source& description() const override { return source_->description(); }
  Window window(const proto::Lattice& lattice) const override { return source_->window(lattice); }
  proto::Result<void> nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg, double* out) override {
    return source_->nearest(longitude_deg, latitude_deg, out);
  }
  proto::Result<void> nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) override {
    return source_->nearest_in_cells(lattice, cells, out);
  }
  proto::Result<std::vector<PixelPoint>> pixels(const proto::Lattice& lattice, const Window& cells) override {
    return source_->pixels(lattice, cells);
  }
  std::string datum_print() const override { return source_->datum_print(); }
  void share_pixels(const std::shared_ptr<SharedPixels>& lately, std::size_t raster) override {
    source_->share_pixels(lately, raster);
  }
  proto::Result<std::shared_ptr<const Decimation>> decimate(std::int64_t most_pixels) override {
    return source_->decimate(most_pixels);
  }

  /// So much void around it that no void it is part of can be filled.
  bool empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns,
             std::int64_t rows) const override {
    if (!source_->empty(lattice, west, south, columns, rows)) return false;
    if (std::max(columns, rows) > limit_cells_) return true;
    const Window w = source_->window(lattice);
    const bool beside = south > w.north || south + rows - 1 < w.south;
    return beside || source_->empty(lattice, west, south, limit_cells_ + 1, rows);
  }

  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override {
    auto samples = source_->sample(lattice, west, south, columns, rows);
    if (!samples.ok()) return samples;
    const auto voids = std::count(samples->height.begin(), samples->height.end(), proto::kNoHeight);
    if (voids == 0) return samples;
    const bool nothing = static_cast<std::size_t>(voids) == samples->height.size();
    if (nothing &&
        (static_cast<std::uint32_t>(std::max(columns, rows)) > limit_cells_ || empty(lattice, west, south, columns, rows)))
      return samples;
    if (!voids_ || voids_->lattice().finest_level != lattice.finest_level) voids_.emplace(*source_, lattice, limit_cells_);
    if (auto done = voids_->fill_in(*samples); !done.ok()) return done.problem();
    return samples;
  }

 private:
  std::unique_ptr<Source> source_;
  std::uint32_t limit_cells_;
  std::optional<VoidMap> voids_;  ///< of the lattice that was asked for last
};

}  // namespace

std::uint32_t fill_limit_cells(const proto::BuildOptions& options) {
  const std::string& voids = options.voids();
  if (voids.empty() && options.nodata() == "hole") return 0;  // a store of an earlier version
  if (!voids.empty() && voids != "fill") return 0;
  return options.has_fill_limit() ? options.fill_limit() : kFillLimit_cells;
}

std::int64_t fill_reach(std::uint32_t limit_cells) { return limit_cells == 0 ? 0 : std::int64_t{limit_cells} + 3; }

std::unique_ptr<Source> fill_enclosed_voids(std::unique_ptr<Source> source, std::uint32_t limit_cells) {
  if (limit_cells == 0) return source;
  return std::make_unique<FilledSource>(std::move(source), std::min(limit_cells, kGreatestFillLimit_cells));
}

}  // namespace cordillera::raster
