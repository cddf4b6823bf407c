#!/usr/bin/env bash
# A GPU that has no memory left gives way to the CPU, and the tiles are the same: tests/gpu/lost_device.sh PROGRAM HOLD_MEMORY RASTER
# Exits with 77 where there is no GPU.
set -euo pipefail
program=$1 hold=$2 raster=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "FAILED: $*" >&2; exit 1; }
# Checksums of all that a dataset holds, but for what says how it was made.
digest() { (cd "$1" && find . -type f ! -name manifest.json ! -name '*.json' -exec sha256sum {} + | sort -k2 | sha256sum); }

"$hold" 1000000000 </dev/null >/dev/null || { echo 'no GPU here'; exit 77; }  # leaves more than there is: holds nothing
"$program" build "$raster" -o "$work/cpu" --device cpu -q
"$program" build "$raster" -o "$work/cuda" --device cuda -q || fail 'a build on the GPU'
[[ $(digest "$work/cpu") == $(digest "$work/cuda") ]] || fail 'the GPU gives other tiles'
[[ $(find "$work/cpu" -name '*.drc' | wc -l) -gt 20 ]] || fail 'few tiles'

lost=0
for left in 2000 1000 800 700 600 550 500 450; do  # MiB: what a context takes differs
  coproc held { "$hold" "$left"; }
  pid=$held_PID
  read -r words <&"${held[0]:-0}" || fail 'the memory cannot be held'
  rm -rf "$work/short"
  if "$program" build "$raster" -o "$work/short" --device cuda >"$work/out" 2>"$work/said"; then
    [[ $(digest "$work/cpu") == $(digest "$work/short") ]] || fail "other tiles with $words"
    if grep -q 'built on cpu, after .* was lost' "$work/out"; then
      lost=$((lost + 1))
      grep -o 'built on cpu, after.*' "$work/out" >"$work/how"
    fi
  else
    grep -q 'device' "$work/said" || fail "with $words: $(cat "$work/said")"  # not even a context: it says so
  fi
  [[ -z ${held[1]:-} ]] || exec {held[1]}>&-
  wait "$pid" 2>/dev/null || true
done
((lost > 0)) || fail 'no build lost its GPU'
echo "$lost builds went on without their GPU, with the same tiles: $(cat "$work/how")"
