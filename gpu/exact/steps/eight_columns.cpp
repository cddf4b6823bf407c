#include "gpu/exact/steps/eight_columns.h"

#include <cstring>

// A sanitizer's own calls do not work yet where the loader chooses between the versions.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    defined(__OPTIMIZE__)
#define CORDILLERA_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define CORDILLERA_WIDE
#endif

namespace cordillera::gpu::exact {
namespace {

using Floats = float __attribute__((vector_size(32)));
using Ints = std::int32_t __attribute__((vector_size(32)));

}  // namespace

CORDILLERA_WIDE bool eight_columns_fit(const Triangle& t, const Field& field, int west, int south, int north) {
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  Ints edge[3];
  for (int k = 0; k < 3; ++k) edge[k] = t.across[k] * lane + t.edge(k, west, south);
  const Ints column = lane + (west - t.ex[0]);
  const Floats u = __builtin_convertvector(column, Floats);
  const Floats along = t.dx * u + t.bend_x * (u * u);
  const float* sample = field.height + field.index(west, south);
  Ints bad = {};
  for (int y = south; y <= north; ++y, sample += field.stride) {
    Floats height;
    std::memcpy(&height, sample, sizeof height);
    const Floats off = (t.height - height) + (along + t.rise_up(static_cast<float>(y - t.ey[0])));
    bad |= ((off > t.tolerance) | (off < -t.tolerance)) & ((edge[0] | edge[1] | edge[2]) >= 0);
    for (int k = 0; k < 3; ++k) edge[k] += t.along[k];
  }
  std::uint64_t any[4];
  std::memcpy(any, &bad, sizeof any);
  return (any[0] | any[1] | any[2] | any[3]) == 0;
}

}  // namespace cordillera::gpu::exact
