#!/usr/bin/env bash
# Builds the release preset and packs it:  deploy/package.sh [build folder]
# Writes cordillera_VERSION_ARCH.deb, cordillera-VERSION-Linux.tar.gz and sbom.json into the build folder's packages/ and prints their
# hashes. The same sources, compiler and folder give the same bytes: every file gets the time of the last commit ($SOURCE_DATE_EPOCH).
# CORDILLERA_BUILD: a build folder that is packed as it is.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
fail() { printf 'package: %s\n' "$*" >&2; exit 1; }

if [[ -z ${SOURCE_DATE_EPOCH:-} ]]; then
  SOURCE_DATE_EPOCH=$(git -C "$root" log -1 --format=%ct 2>/dev/null) || fail "no git here: set SOURCE_DATE_EPOCH, the seconds that files shall bear"
fi
export SOURCE_DATE_EPOCH
build=${CORDILLERA_BUILD:-}
if [[ -z $build ]]; then
  "$root/deploy/build.sh" cordillera
  build=$root/build/release
fi
build=$(cd "$build" && pwd)
[[ -f $build/CPackConfig.cmake ]] || fail "$build is no configured build folder"
out=$build/packages
rm -rf "$out"
umask 022  # folders go into the archive with their modes
(cd "$build" && cpack -B "$out" >"$build/package.log" 2>&1) || { cat "$build/package.log" >&2; fail "cpack failed"; }
rm -rf "$out/_CPack_Packages"
python3 "$root/deploy/sbom.py" >"$out/sbom.json"
cd "$out"
sha256sum -- *
