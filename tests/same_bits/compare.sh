#!/usr/bin/env bash
# Two builds of tile_hashes must print the same: compare.sh PROGRAM PROGRAM
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
ended() { printf '%s ended with %s after this tile:\n' "$1" "$3" >&2; tail -n 1 "$2" >&2; exit 1; }
"$1" >"$work/a" || ended "$1" "$work/a" $?
"$2" >"$work/b" || ended "$2" "$work/b" $?
# Five terrains, four tiles of each and their parent; no two alike.
[[ $(wc -l <"$work/a") -eq 25 ]] || { printf '%s printed %s tiles instead of 25\n' "$1" "$(wc -l <"$work/a")" >&2; exit 1; }
[[ $(awk '{ print $NF }' "$work/a" | sort -u | wc -l) -eq 25 ]] || { printf 'hashes are alike: is anything hashed?\n' >&2; exit 1; }
if ! diff "$work/a" "$work/b" >"$work/apart"; then
  printf 'tiles that differ: < %s, > %s\n' "$1" "$2" >&2
  cat "$work/apart" >&2
  exit 1
fi
tail -n 5 "$work/a"
printf '25 tiles, the same bits from both builds\n'
