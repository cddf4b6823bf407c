#!/usr/bin/env bash
# An npm package of the archive that deploy/package.sh makes:  deploy/npm/make.sh ARCHIVE.tar.gz FOLDER
# Writes FOLDER/cordillera-VERSION.tgz and prints its name. `npx ./cordillera-VERSION.tgz serve` then starts the service. It is published nowhere.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
archive=$(realpath "${1:?usage: deploy/npm/make.sh ARCHIVE.tar.gz FOLDER}") folder=$(realpath "${2:?usage: deploy/npm/make.sh ARCHIVE.tar.gz FOLDER}")
[[ ${archive##*/} =~ ^cordillera-([0-9]+\.[0-9]+\.[0-9]+)-linux-x86_64\.tar\.gz$ ]] || { echo "make.sh: ${archive##*/} is no archive of deploy/package.sh" >&2; exit 1; }
version=${BASH_REMATCH[1]}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$here/cordillera.mjs" "$here/README.md" "$work"
sed "s/\"version\": \"0.0.0\"/\"version\": \"$version\"/" "$here/package.json" >"$work/package.json"
mkdir "$work/program"
tar -xzf "$archive" -C "$work/program" --strip-components=1
cd "$work"
npm pack --silent --pack-destination "$folder"
