#!/usr/bin/env bash
# The packages of the container's second step are those that the program needs: container_file.sh BUILD. An image is not built: that takes
# a registry and a daemon. Exits with 77 where this is no Debian 12.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$(cd "${1:?usage: tests/deploy/container_file.sh BUILD}" && pwd)
grep -q '^VERSION_CODENAME=bookworm' /etc/os-release && command -v dpkg readelf >/dev/null ||
  { printf 'The test of the container file is left out; missing: Debian 12\n'; exit 77; }
listed=$(sed -n '/^FROM debian:12$/,/useradd/p' "$root/deploy/Dockerfile" | tr ' \\' '\n\n' | sort -u)
missing=
for library in $(readelf -d "$build/bin/cordillera" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p'); do
  file=$(ldconfig -p | sed -n "s#^\s*$library (.*x86-64.*) => ##p" | sed -n 1p)
  package=$(dpkg -S "$(readlink -f "$file")" "$file" 2>/dev/null | sed -n 1p | cut -d: -f1 || true)
  case $package in
    libc6 | libstdc++6 | libgcc-s1 | zlib1g | libbrotli1 | libfmt9 | '') ;;  # of every image, or what the others bring
    *) grep -qx "$package" <<<"$listed" || missing+="$library needs $package
" ;;
  esac
done
[[ -z $missing ]] || { printf 'deploy/Dockerfile lacks packages:\n%s' "$missing" >&2; exit 1; }
for file in deploy/packages.txt deploy/cordillera.service deploy/nginx.conf; do [[ -e $root/$file ]]; done
printf 'the container has what the program needs\n'
