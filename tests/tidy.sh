#!/usr/bin/env bash
# clang-tidy over the sources that a build folder compiles:  tests/tidy.sh BUILD [folder or file]...
# Without names: server pipeline raster proto. Checks, and why some are left out: .clang-tidy. Without clang-tidy it says so and exits with 77.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$(cd "${1:?tidy.sh BUILD [folder or file]...}" && pwd)
shift
command -v run-clang-tidy >/dev/null || { echo "tidy: no clang-tidy here (deploy/install.sh --clang)"; exit 77; }
[[ -f $build/compile_commands.json ]] || { echo "tidy: $build is no configured build folder"; exit 1; }
names=("$@")
[[ ${#names[@]} -gt 0 ]] || names=(server pipeline raster proto)
cd "$root"
# g++ knows warnings that clang does not.
run-clang-tidy -quiet -p "$build" -j "${JOBS:-$(nproc)}" -extra-arg=-Wno-unknown-warning-option "${names[@]/#/^$root/}" 2>/dev/null
