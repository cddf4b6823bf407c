#!/usr/bin/env bash
# What cpack packs: the same bytes twice, libraries and folders where they belong, and a program that runs from where it was unpacked.
#   package.sh BUILD
set -euo pipefail
build=$(cd "$1" && pwd)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
fail() { printf 'package: %s\n' "$*" >&2; exit 1; }
for tool in cpack dpkg-deb dpkg-shlibdeps; do
  command -v $tool >/dev/null || { echo "package: no $tool here"; exit 77; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

export SOURCE_DATE_EPOCH=1700000000 CORDILLERA_BUILD=$build
"$root/deploy/package.sh" >"$work/first"
made=$(date +%s)
until [[ $(date +%s) != "$made" ]]; do sleep 0.1; done  # another time of day
"$root/deploy/package.sh" >"$work/second"
cmp "$work/first" "$work/second" || fail "two packages of one build differ"

deb=$(echo "$build"/packages/*.deb)
dpkg-deb --fsys-tarfile "$deb" | tar -x -C "$work"
[[ $("$work/usr/bin/cordillera" --version) == 'cordillera '[0-9]* ]] || fail "the program does not run"
[[ -f $work/usr/share/doc/cordillera/LICENSE ]] || fail "the licence is missing"
depends=$(dpkg-deb -f "$deb" Depends)
[[ $depends == *libgdal* ]] || fail "Depends does not name GDAL: $depends"
[[ $depends == *proj-data* ]] || fail "Depends does not name proj-data"
[[ $(ldd "$work/usr/bin/cordillera") != *'not found'* ]] || fail "a library is missing"

# Everything that the program is linked with belongs to a package that Depends names, or to one that such a package needs.
tar -xzf "$build"/packages/*.tar.gz -C "$work"
printf 'ncols 8\nnrows 8\nxllcorner 10\nyllcorner 46\ncellsize 0.01\n' >"$work/a.asc"
for row in 1 2 3 4 5 6 7 8; do echo "1 2 3 4 5 6 7 $row" >>"$work/a.asc"; done
"$work"/cordillera-*/bin/cordillera build "$work/a.asc" -o "$work/a.sqlite" --crs EPSG:4326 --vertical-datum EGM96 -q || fail "the .tar.gz does not build tiles above its own geoid grid"
"$work"/usr/bin/cordillera check "$work/a.sqlite" || fail "what it built is not sound"
python3 -c 'import json, sys; assert len(json.load(open(sys.argv[1]))["components"]) > 20' "$build/packages/sbom.json" || fail "sbom.json holds too little"
