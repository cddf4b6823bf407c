#!/usr/bin/env bash
# Makes the picture of README.md: tests/browser/readme_picture.sh BUILD [FILE]    (default: docs/pictures/white_mountains.jpg)
# The shipped sample in the viewer, heights by colour under the server's own hillshade. It takes minutes without a GPU. No test: look at it.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/browser/readme_picture.sh BUILD [FILE]}" && pwd)
. "$here/../real_server.sh" 'The picture'
need_node
need_chromium
[[ -e $build/share/web/complete ]] || leave_out "the viewer in $build/share/web"
modules=$build/browser/npm
mkdir -p "$modules"
node_modules "$here" "$modules"
cp "$here"/*.mjs "$modules"

start_server "$build"
id=$("$cordillera" post "$repository/deploy/sample/white_mountains_srtm3.tif" --error 4 --wait --quiet --json | json_id)
node "$modules/readme_picture.mjs" "$chromium" "$url" "$id" "${2:-$repository/docs/pictures/white_mountains.jpg}"
