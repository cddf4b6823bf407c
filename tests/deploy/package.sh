#!/usr/bin/env bash
# What deploy/package.sh packs: the same bytes twice; a .deb whose program runs; an archive that runs where there is nothing but glibc.
#   package.sh BUILD
# clean_machine.sh does the same on whole systems that were made for it.
set -euo pipefail
build=$(cd "$1" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/../real_server.sh" 'The test of the packages'
fail() { printf 'package: %s\n' "$*" >&2; exit 1; }
for tool in cpack dpkg-deb dpkg-shlibdeps readelf gcc curl; do command -v $tool >/dev/null || leave_out $tool; done

export SOURCE_DATE_EPOCH=1700000000 CORDILLERA_BUILD_FOLDER=$build
"$repository/deploy/package.sh" >"$work/first"
"$repository/deploy/package.sh" >"$work/second"  # it takes more than a second, so the time of day is another
cmp "$work/first" "$work/second" || fail "two packages of one build differ"

deb=$(echo "$build"/packages/*.deb)
dpkg-deb --fsys-tarfile "$deb" | tar -x -C "$work"
[[ $("$work/usr/bin/cordillera" --version) == 'cordillera '[0-9]* ]] || fail "the program does not run"
[[ -f $work/usr/share/doc/cordillera/LICENSE ]] || fail "the licence is missing"
[[ -x $work/usr/share/doc/cordillera/deploy/slurm/submit.sh ]] || fail "the scripts for clusters are missing"
dpkg-deb --ctrl-tarfile "$deb" | tar -x -O ./postinst | grep -q systemd-sysusers || fail "nothing makes the user of the unit"
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
unpacked=$work/unpacked
mv "$work"/cordillera-* "$unpacked"
for file in "$unpacked"/bin/cordillera "$unpacked"/lib/cordillera/*; do
  newer=$(readelf -WV "$file" | grep -oE 'Name: GLIBC_2\.[0-9]+' | sort -Vu | awk -F. '$2 > 34') || true
  [[ -z $newer ]] || fail "$file needs more than glibc 2.34: $newer"
done
outside=$(ldd "$unpacked/bin/cordillera" | awk '$2 == "=>" && $3 !~ /unpacked\/bin\/\.\.\/lib\/cordillera/ { print $1 }' |
  grep -vE '^lib(c|m|dl|rt|pthread|resolv|gcc_s)\.so' || true)
[[ -z $outside ]] || fail "the archive lacks $outside"
[[ -s $unpacked/share/doc/cordillera/licences/libgdal32 ]] || fail "the licences of the libraries are missing"

# PROJ's tables are its own, whatever the environment says of another PROJ's.
printf 'ncols 8\nnrows 8\nxllcorner 2600000\nyllcorner 1200000\ncellsize 100\n' >"$work/a.asc"
for row in 1 2 3 4 5 6 7 8; do echo "1 2 3 4 5 6 7 $row" >>"$work/a.asc"; done
words=(--crs EPSG:2056 --vertical-datum EGM96 --device cpu -q)
env PROJ_DATA=/nowhere PROJ_LIB=/nowhere "$unpacked/bin/cordillera" build "$work/a.asc" -o "$work/tiles" "${words[@]}" ||
  fail "the archive does not build tiles with its own tables"
"$work"/usr/bin/cordillera check "$work/tiles" || fail "what it built is not sound"

# No format needs a library that is left out.
PROGRAM_UNDER_TEST=$unpacked/bin/cordillera "$build/bin/program_test" --gtest_filter=SentPosts.HeightsAreThoseOfTheGeoTiff >"$work/formats" ||
  { cat "$work/formats" >&2; fail "the archive does not read a format that the build reads"; }

. "$here/package_alone.sh"
