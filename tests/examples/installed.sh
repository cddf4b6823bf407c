#!/usr/bin/env bash
# The simplifier is installed, and projects that know only the installation are built with it, in C and in C++ and in C alone: installed.sh BUILD
set -euo pipefail
build=$(cd "${1:?usage: tests/examples/installed.sh BUILD}" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
fail() { printf 'installed: %s\n' "$*" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cmake --install "$build" --component dev --prefix "$work/prefix" >"$work/log"
built() {  # PROJECT FOLDER
  cmake -S "$1" -B "$2" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix" >>"$work/log" 2>&1 &&
    cmake --build "$2" >>"$work/log" 2>&1 || { cat "$work/log" >&2; fail "$1 is not built"; }
}
built "$here/installed" "$work/build"
built "$here/installed/in_c" "$work/in_c"
! cmake -S "$here/installed" -B "$work/other" -DCMAKE_PREFIX_PATH="$work/none" >"$work/log" 2>&1 || fail "cordillera is found where it is not installed"
"$work/build/hill_c" >"$work/c"
"$work/build/hill_cpp" >"$work/cpp"
cmp "$work/c" "$work/cpp" || fail "C and C++ do not get the same"
"$work/in_c/hill" | cmp "$work/c" || fail "a project in C alone does not get the same"
grep -qE '^2000 of 20000 triangles, RMSE 0\.[0-9]+ m' "$work/c" || fail "not what the documents say: $(<"$work/c")"
grep -q '^mesh-not-finite: .*7' "$work/c" || fail "a mesh with NaN is not refused by its place: $(<"$work/c")"
if grep -rq "$build\|$(cd "$here/../.." && pwd)" "$work/prefix/lib"*/cmake "$work/prefix/include"; then fail "the installation names the build folder"; fi
cat "$work/c"
