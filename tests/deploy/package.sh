#!/usr/bin/env bash
# What deploy/package.sh packs: the same bytes twice; a .deb whose program runs; an archive that runs where there is nothing but glibc.
#   package.sh BUILD
# clean_machine.sh does the same on whole systems that were made for it.
set -euo pipefail
build=$(cd "$1" && pwd)
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
fail() { printf 'package: %s\n' "$*" >&2; exit 1; }
for tool in cpack dpkg-deb dpkg-shlibdeps readelf; do
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
[[ ! -e $work/usr/include ]] || fail "headers are in the package of the program"
depends=$(dpkg-deb -f "$deb" Depends)
[[ $depends == *libgdal* ]] || fail "Depends does not name GDAL: $depends"
[[ $depends == *proj-data* ]] || fail "Depends does not name proj-data"
[[ $(ldd "$work/usr/bin/cordillera") != *'not found'* ]] || fail "a library is missing"
python3 -c 'import json, sys; assert len(json.load(open(sys.argv[1]))["components"]) > 20' "$build/packages/sbom.json" || fail "sbom.json holds too little"

# The archive.
archive=$(echo "$build"/packages/*.tar.gz)
(( $(stat -c %s "$archive") <= 60000000 )) || fail "the archive has $(stat -c %s "$archive") bytes, more than 60 MB"
tar -xzf "$archive" -C "$work"
mv "$work"/cordillera-* "$work/unpacked"
for file in "$work"/unpacked/bin/cordillera "$work"/unpacked/lib/cordillera/*; do
  newer=$(readelf -WV "$file" | grep -oE 'Name: GLIBC_2\.[0-9]+' | sort -Vu | awk -F. '$2 > 34') || true
  [[ -z $newer ]] || fail "$file needs more than glibc 2.34: $newer"
done
outside=$(ldd "$work/unpacked/bin/cordillera" | awk '$2 == "=>" && $3 !~ /unpacked\/bin\/\.\.\/lib\/cordillera/ { print $1 }' |
  grep -vE '^lib(c|m|dl|rt|pthread|resolv|gcc_s)\.so' || true)
[[ -z $outside ]] || fail "the archive lacks $outside"
[[ -s $work/unpacked/share/doc/cordillera/licences/libgdal32 ]] || fail "the licences of the libraries are missing"

# PROJ's tables are its own, whatever the environment says of another PROJ's.
printf 'ncols 8\nnrows 8\nxllcorner 2600000\nyllcorner 1200000\ncellsize 100\n' >"$work/a.asc"
for row in 1 2 3 4 5 6 7 8; do echo "1 2 3 4 5 6 7 $row" >>"$work/a.asc"; done
words=(--crs EPSG:2056 --vertical-datum EGM96 --device cpu -q)
env PROJ_DATA=/nowhere PROJ_LIB=/nowhere "$work/unpacked/bin/cordillera" build "$work/a.asc" -o "$work/tiles" "${words[@]}" ||
  fail "the archive does not build tiles with its own tables"
"$work"/usr/bin/cordillera check "$work/tiles" || fail "what it built is not sound"

# Alone with glibc: a root of its own. Only root may make one.
if [[ $(id -u) == 0 ]]; then
  install -D /lib64/ld-linux-x86-64.so.2 "$work/alone/lib64/ld-linux-x86-64.so.2"
  for name in libc.so.6 libm.so.6 libgcc_s.so.1 libresolv.so.2; do
    install -D "$(ldconfig -p | sed -n "s#^\s*$name (.*x86-64.*) => ##p" | sed -n 1p)" "$work/alone/lib/x86_64-linux-gnu/$name"
  done
  mkdir -p "$work/alone/proc" "$work/alone/tmp"
  mv "$work/unpacked" "$work/alone/anywhere"
  cp "$work/a.asc" "$work/alone/tmp"
  unshare --mount bash -c 'mount -t proc proc "$1/proc" && exec chroot "$@"' _ "$work/alone" /anywhere/bin/cordillera build /tmp/a.asc -o /tmp/tiles \
    "${words[@]}" || fail "the archive does not run alone with glibc"
  diff -r "$work/tiles/tiles" "$work/alone/tmp/tiles/tiles" || fail "alone it builds other tiles"
else
  echo "package: not tried alone with glibc: only root can make a root"
fi
