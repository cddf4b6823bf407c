#pragma once
// Functions marked so are compiled for the host and, under nvcc, for the device: one source, the same bits.
#ifdef __CUDACC__
#define CORDILLERA_HD __host__ __device__
#else
#define CORDILLERA_HD
#endif
