#!/usr/bin/env bash
# Builds the release preset and packs it:  deploy/package.sh
# Writes into the build folder's packages/, and prints their hashes:
#   cordillera_VERSION_ARCH.deb                Debian 12; what it needs comes by apt
#   cordillera-VERSION-linux-ARCH.tar.gz       any Linux with glibc 2.34 or newer: libraries, PROJ's tables, EGM96 and the sample are in it
#   cordillera-VERSION-py3-none-any.whl        the Python client
#   sbom.json                                  what they are made of
# The same sources, compiler and folder give the same bytes: every file gets the time of the last commit ($SOURCE_DATE_EPOCH).
# CORDILLERA_BUILD_FOLDER: a build folder that is packed as it is.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
fail() { printf 'package: %s\n' "$*" >&2; exit 1; }

if [[ -z ${SOURCE_DATE_EPOCH:-} ]]; then
  SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct 2>/dev/null) || fail "no git here: set SOURCE_DATE_EPOCH, the seconds that files shall bear"
fi
export SOURCE_DATE_EPOCH
build=${CORDILLERA_BUILD_FOLDER:-}
if [[ -z $build ]]; then
  CORDILLERA_CMAKE_ARGS="-DCORDILLERA_CUDA_DEVICES=all ${CORDILLERA_CMAKE_ARGS:-}" "$root/deploy/build.sh" cordillera
  build=$root/build/release
fi
build=$(cd "$build" && pwd)
[[ -f $build/CPackConfig.cmake ]] || fail "$build is no configured build folder"
[[ -e $build/share/web/complete ]] || printf 'package: the viewer was not built; the packages are without it\n' >&2
out=$build/packages
rm -rf "$out"
umask 022  # folders go into the archive with their modes
mkdir "$out"
# Side by side: each is done by one processor.
"$root/deploy/portable/archive.sh" "$build" "$out" >"$build/archive.log" 2>&1 &
archive=$!
(cd "$build" && cpack -B "$out" >"$build/package.log" 2>&1) || { cat "$build/package.log" >&2; kill $archive; fail "cpack failed"; }
rm -rf "$out/_CPack_Packages"
wait $archive || { cat "$build/archive.log" >&2; fail "no archive was made"; }
"$root/deploy/python/make_wheel.py" "$out" >/dev/null
python3 "$root/deploy/sbom.py" >"$out/sbom.json"
cd "$out"
sha256sum -- *
