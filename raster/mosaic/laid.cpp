#include "raster/mosaic/laid.h"

#include <algorithm>

#include "proto/integers.h"

namespace cordillera::raster {
namespace {

/// Asks vertices of the window that a raster reaches, by their place in laid, until one answers yes.
template <class Ask>
bool any_vertex(const Source::Window& reach, const Laid& laid, const proto::Lattice& lattice, const Ask& ask) {
  const proto::Samples& s = laid.samples;
  const std::int64_t south = std::max(reach.south, s.south), north = std::min(reach.north, s.south + s.rows - 1);
  std::vector<std::int32_t> columns;
  for (std::int32_t c = 0; c < s.columns; ++c)
    if (proto::modulo(s.west + c - reach.west, lattice.columns()) <= reach.east - reach.west) columns.push_back(c);
  for (std::int64_t j = south; j <= north; ++j) {
    const auto row = static_cast<std::size_t>((j - s.south) * s.columns);
    for (const std::int32_t c : columns)
      if (ask(row + static_cast<std::size_t>(c))) return true;
  }
  return false;
}

}  // namespace

bool may_add(const Source::Window& reach, const Laid& laid, const proto::Lattice& lattice) {
  return any_vertex(reach, laid, lattice, [&](std::size_t v) { return laid.owners[v] == kNobody; });
}

proto::Result<void> put_heights(const proto::Lattice& lattice, std::span<const Layer> layers, const WithHeights& with_heights,
                                Laid& laid) {
  std::vector<std::uint32_t> rasters(laid.owners.size());  // that reach a vertex
  for (const Layer& layer : layers) {
    any_vertex(layer.reach, laid, lattice, [&](std::size_t v) {
      ++rasters[v];
      return false;
    });
  }
  const auto takes = [&](std::size_t v) { return laid.owners[v] == kNobody || rasters[v] == 1; };
  for (const Layer& layer : layers) {
    if (!layer.puts_height || !any_vertex(layer.reach, laid, lattice, takes)) continue;
    const auto own = with_heights(layer.member);
    if (!own.ok()) return own.problem();
    any_vertex(layer.reach, laid, lattice, [&](std::size_t v) {
      if (!takes(v) || own->height[v] == proto::kNoHeight) return false;
      laid.samples.height[v] = own->height[v], laid.samples.flat_water[v] = own->flat_water[v];
      laid.owners[v] = layer.member;
      return false;
    });
  }
  return {};
}

}  // namespace cordillera::raster
