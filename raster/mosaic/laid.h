#pragma once
// Rasters laid over each other at the vertices of a window.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "proto/mesh.h"
#include "raster/source.h"

namespace cordillera::raster {

inline constexpr std::size_t kNobody = SIZE_MAX,
                             kSeveral = SIZE_MAX - 1;  ///< the latter where more than one has a part in a blend

/// Heights at the vertices of a window, and whose they are. Void, and nobody's, at first.
struct Laid {
  explicit Laid(const Source::Window& w) : samples(void_samples(w)), owners(samples.height.size(), kNobody) {}
  proto::Samples samples;
  std::vector<std::size_t> owners;  ///< members; indexed as samples.height
};

/// Whether a raster may have data where nobody has any yet. reach: the vertices at which it may have some.
bool may_add(const Source::Window& reach, const Laid& laid, const proto::Lattice& lattice);

struct Layer {
  std::size_t member = 0;
  Source::Window reach;
  bool puts_height = false;  ///< where it has no data
};
/// Samples of the window of a member, with its heights in place of voids.
using WithHeights = std::function<proto::Result<proto::Samples>(std::size_t member)>;
/// Where nobody has data: the height of the first layer that puts one there. Where one layer alone may have data it is what it is
/// without the others, also between its data and such heights. layers: all that reach the window, the first of which wins.
proto::Result<void> put_heights(const proto::Lattice& lattice, std::span<const Layer> layers, const WithHeights& with_heights,
                                Laid& laid);

}  // namespace cordillera::raster
