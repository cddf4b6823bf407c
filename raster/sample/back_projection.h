#pragma once
// A source whose samples are moved until the surface between them meets the source's own pixels.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "cordillera.pb.h"
#include "proto/ellipsoid.h"
#include "raster/sample/bounds_around.h"
#include "raster/source.h"

namespace cordillera::raster {

/// What pixels= of a build may be; the first is the default.
inline constexpr const char *kExactPixels = "exact", *kLatticePixels = "lattice";
inline constexpr const char* kPixelChoices[] = {kExactPixels, kLatticePixels};

/// Greatest spacing of a lattice that can meet all pixels: beyond it there are more pixels than samples. A little over 1, for the
/// rounding of pixel sizes.
inline constexpr double kMostSpacing = 1.001;

/// Cells of the lattice in pixels of the source, the greater of both directions, at the source's centre.
inline double spacing(const proto::Source& source, const proto::Lattice& lattice) {
  constexpr double kRadians = 3.14159265358979323846 / 180;
  const double latitude = (source.bbox(1) + source.bbox(3)) / 2;
  const double cell_m = proto::cell_height_m(lattice, std::llround((latitude + 90) / 180 * static_cast<double>(lattice.rows())));
  return std::max(cell_m / source.pixel_height_m(), cell_m * std::cos(latitude * kRadians) / source.pixel_width_m());
}

/// Cells around a sample whose pixels and samples it may depend on: one a round, and those that its bounds are made of.
inline constexpr int kProjectionRounds = 12;
inline constexpr std::int64_t kProjectionReach = kProjectionRounds + kBoundsReach + 2;

/// The same source, but samples of the lattice of that level are moved until the surface between them (proto::triangle_around) is
/// within so many metres of the pixels, and nearer beside the sides of tiles. What a pixel's centre is farther off is spread onto
/// the three vertices around it, in kProjectionRounds rounds. In the first eight of them no sample beside a wall leaves the
/// heights of the samples up to kBoundsReach away and of the pixels that move it, lest it rings more than it must. A sample
/// depends on the source's pixels and samples around it, the lattice and within_m alone, not on what else the source holds.
/// Beside a pole no sample moves farther than some thousand times a column's width. Stay as they are: still water, poles, voids,
/// and vertices beside which no pixel is too far off. Voids that are filled move. What would leave the range of heights is held
/// to it.
std::unique_ptr<Source> project_back(std::unique_ptr<Source> source, int level, double within_m);

}  // namespace cordillera::raster
