#!/usr/bin/env bash
# Configures and builds the release preset in build/release:  deploy/build.sh [target]...
# nvcc is looked for in its usual place too, since CUDA's installers leave PATH alone. CORDILLERA_CMAKE_ARGS adds configure options.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v nvcc >/dev/null && [[ -x /usr/local/cuda/bin/nvcc ]]; then
  export PATH=$PATH:/usr/local/cuda/bin
fi
# g++ clears up its memory less often where each of its processes may take more of it: a tenth of its time, and the same objects. Counts for a
# new build folder alone.
if [[ -z ${CXX:-} && $(awk '/^MemTotal:/ { print int($2 / 1000000) }' /proc/meminfo) -ge $((3 * $(nproc))) ]]; then
  export CXXFLAGS="${CXXFLAGS:-} --param=ggc-min-heapsize=1048576"
fi
mkdir -p build
read -r -a extra <<<"${CORDILLERA_CMAKE_ARGS:-}"
cmake --preset release -DCORDILLERA_CUDA_DEVICES=here "${extra[@]}" >build/configure.log 2>&1 || { cat build/configure.log >&2; rm -f build/configure.log; exit 1; }
grep -E 'Cordillera:' build/configure.log || true
rm -f build/configure.log

targets=("$@")
if [[ ${#targets[@]} -eq 0 ]]; then
  cmake --build build/release
  exit
fi
# The viewer is a target only where npm is.
if cmake --build build/release --target help | grep '^viewer:' >/dev/null; then
  targets+=(viewer)
fi
cmake --build build/release --target "${targets[@]}"
