#pragma once
// A source whose samples are moved until the surface between them meets the source's own pixels.
#include <algorithm>
#include <cmath>
#include <memory>

#include "cordillera.pb.h"
#include "proto/ellipsoid.h"
#include "raster/source.h"

namespace cordillera::raster {

/// What pixels= of a build may be; the first is the default.
inline constexpr const char* kPixelChoices[] = {"lattice", "exact"};
inline bool meets_pixels(const proto::BuildOptions& options) { return options.pixels() == kPixelChoices[1]; }

/// Greatest spacing of a lattice whose surface can meet all pixels: then hardly two of them lie in one triangle. Up to a spacing of 1 they can be
/// met, too, but samples go up and down between them, and shaded relief shows a weave.
inline constexpr double kMeetingSpacing = 0.7;

/// Cells of the lattice in pixels of the source, the greater of both directions, at the source's centre.
inline double spacing(const proto::Source& source, const proto::Lattice& lattice) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  const double latitude = (source.bbox(1) + source.bbox(3)) / 2;
  const double cell_m = proto::cell_height_m(lattice, std::llround((latitude + 90) / 180 * static_cast<double>(lattice.rows())));
  return std::max(cell_m / source.pixel_height_m(), cell_m * std::cos(latitude * kRadians) / source.pixel_width_m());
}

/// The same source, but the samples of lattices that are no coarser than the pixels are moved. The surface is the one between vertices, each
/// cell cut from south-west to north-east; where the cell's only void is one of these two, the other way. What is missing at a pixel's centre is
/// spread onto the three vertices around it, kRounds times over. A sample depends on raster and lattice alone: on the pixels and vertices up to
/// kRounds + 1 cells around. Stay as they are: still water, poles, voids, and vertices beside which no pixel lies. Voids that are filled move.
/// What would leave the range of heights is held to it.
std::unique_ptr<Source> project_back(std::unique_ptr<Source> source);

}  // namespace cordillera::raster
