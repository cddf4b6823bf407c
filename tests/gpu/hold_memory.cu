// Holds the memory of a GPU but for so many MiB, until its input ends: hold_memory MIB
#include <cuda_runtime.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::size_t leave = std::strtoull(argv[1], nullptr, 10) << 20;
  std::size_t free = 0, total = 0;
  for (std::size_t piece = std::size_t{1} << 36; piece >= (std::size_t{1} << 20);) {
    if (cudaMemGetInfo(&free, &total) != cudaSuccess) return 1;
    void* held = nullptr;
    if (free < leave + piece || cudaMalloc(&held, piece) != cudaSuccess) piece /= 2;
  }
  std::printf("%zu MiB left of %zu\n", free >> 20, total >> 20);
  std::fflush(stdout);
  while (std::getchar() != EOF) {}
}
