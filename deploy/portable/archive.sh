#!/usr/bin/env bash
# The archive that needs nothing of its machine but glibc:  deploy/portable/archive.sh BUILD FOLDER
# deploy/package.sh calls it. It is the installation with private copies of the libraries (bundle.py), PROJ's tables and the sample.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$1 out=$2
version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
name=cordillera-$version-linux-$(uname -m)
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT

cmake --install "$build" --component Unspecified --prefix "$stage/$name" --strip
"$root/deploy/portable/bundle.py" "$stage/$name/bin/cordillera" "$stage/$name/lib/cordillera" "$stage/$name/share/doc/cordillera/licences"
share=$stage/$name/share/cordillera
dpkg -L proj-data | sed -n 's#^/usr/share/proj/##p' | while read -r file; do install -Dm644 "/usr/share/proj/$file" "$share/proj/$file"; done
mkdir "$share/sample"
cp "$root"/deploy/sample/* "$share/sample"
if [[ -d $share/web/sample ]]; then ln -f "$share/sample"/* "$share/web/sample"; fi  # the viewer's: once in the archive
cp "$root/deploy/portable/README.txt" "$stage/$name"
chmod -R u=rwX,go=rX "$stage/$name"
tar -C "$stage" --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner -c "$name" | gzip -6n >"$out/$name.tar.gz"
