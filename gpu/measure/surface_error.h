#pragma once
// The true error of a tile: what a client sees against every finest sample the tile covers.
#include <cstdint>
#include <vector>

#include "gpu/measure/ecef_steps.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// Added to every error that is stated: trigonometry of other programs differs from our rounded tables by micrometres, on slopes.
inline constexpr double kGrace_m = 1.0 / 1024;

struct SampleFrames;
struct SurfaceMemory;

/// The error of a surface is the distance, along the ellipsoid's normal, from each valid finest sample to the flat ECEF triangle
/// that covers it. Two decodings are measured at once: exact lattice positions (.drc) and ECEF rounded to multiples of
/// ecef_steps (.glb).
struct SurfaceErrorInput {
  const proto::Lattice* lattice = nullptr;
  proto::TileAddress tile;
  const proto::TileMesh* mesh = nullptr;  ///< void triangles are skipped (their samples count as uncovered when valid)
  /// Finest samples. What lies outside their window counts as invalid. Columns are taken modulo the circle.
  const proto::Samples* samples = nullptr;
  EcefSteps ecef_steps;
  const SampleFrames* frames = nullptr;  ///< of samples; null: made for the call
};

struct SurfaceError {
  double max_m = 0;             ///< over both decodings; an upper bound also for samples that chords move to a neighbour triangle
  double sum_squared_m2 = 0;    ///< of the .drc decoding, each sample once (tile's western and southern border included, eastern
                                ///< and northern too: a shared sample counts in every tile that shows it)
  std::uint32_t samples = 0;    ///< valid samples covered and summed. Counts saturate at 2^32 - 1. A triangle of two corners on a
                                ///< pole has no area: its samples are neither summed nor uncovered, its neighbours show them
  std::uint32_t uncovered = 0;  ///< valid samples in no triangle
  std::uint32_t overcovered = 0;  ///< invalid samples strictly inside a triangle
  struct Worst {                  ///< worst sample of a triangle that exceeds the limit asked for
    std::uint32_t triangle = 0;
    std::int32_t x = 0, y = 0;  ///< tile-local units. The worst sample inside, if that exceeds the limit; else it may lie on a
                                ///< corner, or beyond an edge whose chord may show it
    double error_m = 0;         ///< the worst of all, also beyond the edges
  };
  std::vector<Worst> over_limit;  ///< one for each triangle whose error exceeds limit_m, in triangle order
};

SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m);
/// Again and again, of a mesh that changes; see SurfaceMemory.
SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m, SurfaceMemory& memory);

/// Of over_limit.
std::vector<std::uint32_t> triangles_over(const SurfaceError& error);

}  // namespace cordillera::gpu
