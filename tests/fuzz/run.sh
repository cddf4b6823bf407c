#!/usr/bin/env bash
# Builds the fuzzers with clang, libFuzzer, ASan and UBSan, and runs each for so many seconds:  tests/fuzz/run.sh [seconds] [fuzzer]...
# Without clang (deploy/install.sh --clang) it says so and exits with 77. What crashes is left in build/fuzz/found; put it into corpus/ once it is mended.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
seconds=${1:-10}
shift || true
fuzzers=("$@")
[[ ${#fuzzers[@]} -gt 0 ]] || fuzzers=(address http mesh_file messages raster)
command -v clang++ >/dev/null || { echo "fuzz: no clang++ here (deploy/install.sh --clang)"; exit 77; }
cmake -S "$root" -B "$root/build/fuzz" -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" -DCORDILLERA_CUDA=OFF -DCORDILLERA_FUZZ=ON >/dev/null
cmake --build "$root/build/fuzz" -j "${JOBS:-$(nproc)}" --target "${fuzzers[@]/#/fuzz_}"
mkdir -p "$root/build/fuzz/found"
cd "$root/build/fuzz"
failed=()
for fuzzer in "${fuzzers[@]}"; do
  mkdir -p "grown/$fuzzer"
  echo "== $fuzzer, $seconds s"
  bin/fuzz_"$fuzzer" -max_total_time="$seconds" -max_len=8192 -timeout=20 -rss_limit_mb=2048 -artifact_prefix=found/ "grown/$fuzzer" \
    "$root/tests/fuzz/corpus/$fuzzer" || failed+=("$fuzzer")
done
[[ ${#failed[@]} -eq 0 ]] || { echo "fuzz: found something: ${failed[*]}"; exit 1; }
