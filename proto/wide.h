#pragma once
// CORDILLERA_WIDE before a function: compiled a second time for processors with AVX2, and the loader takes what fits. The bits
// are the same: nothing is contracted, and no sum is taken in another order.

// A sanitizer's own calls do not work yet where the loader chooses between the versions.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    defined(__OPTIMIZE__)
#define CORDILLERA_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define CORDILLERA_WIDE
#endif
