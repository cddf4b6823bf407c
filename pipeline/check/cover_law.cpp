#include "pipeline/check/cover_law.h"

#include <algorithm>
#include <optional>

#include "pipeline/bound/cover.h"
#include "pipeline/encode/draco_mesh.h"
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline::check {
namespace {

constexpr std::int64_t kWindow = 2048;  // samples across what is read at once; as wide as that may a cell be

/// What of the tile may have data.
TileRectangle part_with_data(const proto::Lattice& lattice, const proto::TileAddress& tile, const raster::Source::Window& w) {
  proto::Samples window;
  window.west = w.west, window.south = w.south;
  window.columns = static_cast<std::int32_t>(w.east - w.west + 1), window.rows = static_cast<std::int32_t>(w.north - w.south + 1);
  return part_in_window(lattice, tile, window);
}

}  // namespace

void check_cover(const raster::Source& source, KnownSamples& known, const proto::Plan& plan, const CheckedTile& tile,
                 Report& report) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t cell = lattice.cell_units(tile.tile.z), west = lattice.west(tile.tile), south = lattice.south(tile.tile);
  const raster::Source::Window all = node_window(plan, tile.tile, 0), around = node_window(plan, tile.tile, cell);
  if (all.west > all.east || all.south > all.north) return;  // somebody else's finding
  if (std::min(around.east - around.west, around.north - around.south) < 2 * cell && around.south > 0 &&
      around.north < lattice.rows())
    return;
  if (cell > kWindow) {
    ++report.unmeasured;
    return;
  }
  const proto::TileMesh mesh = tile_mesh_of(tile.drc);
  const TileRectangle whole = part_with_data(lattice, tile.tile, all);
  std::uint64_t count = 0;
  std::optional<gpu::MeshPoint> one;
  for (std::int64_t y = whole.south; y <= whole.north; y += kWindow) {
    for (std::int64_t x = whole.west; x <= whole.east; x += kWindow) {
      const TileRectangle part{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                               static_cast<std::int32_t>(std::min<std::int64_t>(x + kWindow - 1, whole.east)),
                               static_cast<std::int32_t>(std::min<std::int64_t>(y + kWindow - 1, whole.north))};
      const raster::Source::Window window{west + part.west - cell, std::max<std::int64_t>(south + part.south - cell, 0),
                                          west + part.east + cell, std::min(south + part.north + cell, lattice.rows())};
      // Between rasters that lie far apart there is nothing to be covered.
      if (source.empty(lattice, window.west, window.south, window.east - window.west + 1, window.north - window.south + 1))
        continue;
      const auto samples = known.sample(window);
      if (!samples)
        return report.findings.add(name_of(tile.tile), "the raster cannot be read there: " + samples.problem().detail);
      const auto left = uncovered_inside(lattice, tile.tile, mesh, *samples, part);
      count += left.size();
      if (!one && !left.empty()) one = left.front();
    }
  }
  if (count == 0) return;
  report.findings.add(name_of(tile.tile),
                      std::to_string(count) +
                          " samples with data are uncovered and farther than a cell from any void, one of them at (" +
                          std::to_string(one->x) + ", " + std::to_string(one->y) + ")");
}

}  // namespace cordillera::pipeline::check
