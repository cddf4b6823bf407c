#pragma once
// One window of samples laid over another.
#include <cstdint>
#include <vector>

#include "proto/mesh.h"
#include "raster/source.h"

namespace cordillera::raster {

/// Distance of every sample to the nearest one without data, in samples, diagonals counted as one (Rosenfeld and Pfaltz 1966); at
/// most `most`, and `most` where the window ends before it is met. Indexed as samples.height.
std::vector<std::uint16_t> distance_to_void(const proto::Samples& samples, int most);

/// Puts `top` over `below`, both of one window. Where only one has data it is taken. Where both have, top gives way to below over
/// the last `feather` samples before its own rim, and as far as below does not end there itself: so neither rim shows as a step.
/// Distances are true at least `feather` samples inside the window. feather 0: top wins. Indexed by sample: 1 where both have a
/// part.
std::vector<std::uint8_t> lay_over(const proto::Samples& top, proto::Samples& below, int feather);

/// What of the window `from` holds; the rest is void.
proto::Samples cut_out(const proto::Samples& from, const Source::Window& window);

}  // namespace cordillera::raster
