#!/usr/bin/env bash
# Takes the pictures of the viewer that the documents show: tests/browser/pictures.sh BUILD FOLDER [NAME,NAME...]
#   BUILD    a build folder with bin/cordillera and share/web
#   FOLDER   where the pictures go, as JPEG, and one that moves, as WebP: docs/pictures/viewer in the repository
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
usage='usage: tests/browser/pictures.sh BUILD FOLDER [NAME,NAME...]'
build=$(cd "${1:?$usage}" && pwd)
pictures=${2:?$usage}
. "$here/../real_server.sh" 'The script of pictures'
need_node
need_chromium
[[ -e $build/share/web/complete ]] || leave_out "the viewer in $build/share/web"
mkdir -p "$pictures"
modules=$build/browser/npm
node_modules "$here" "$modules"
cp "$here"/*.mjs "$modules"
server_data=$work/empty start_server "$build"
empty=$url
start_server "$build"
id=$(post "$repository/deploy/sample/white_mountains_srtm3.tif")
node "$modules/pictures.mjs" --chromium "$chromium" --url "$url" --empty "$empty" --dataset "$id" --pictures "$pictures" ${3:+--only "$3"}
