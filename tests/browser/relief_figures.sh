#!/usr/bin/env bash
# What the viewer's relief costs and how near it is to its finest picture: tests/browser/relief_figures.sh BUILD RASTER
#   BUILD    a build folder with bin/cordillera and share/web
# Prints a row for each way that the viewer draws it. Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
usage='usage: tests/browser/relief_figures.sh BUILD RASTER'
build=$(cd "${1:?$usage}" && pwd)
raster=$(realpath "${2:?$usage}")
. "$here/../real_server.sh" 'The script of figures'
need_node gdal_translate
need_chromium
[[ -e $build/share/web/complete ]] || leave_out "the viewer in $build/share/web"
modules=$build/browser/npm
node_modules "$here" "$modules"
cp "$here"/*.mjs "$modules"
start_server "$build"
node "$modules/relief_figures.mjs" --chromium "$chromium" --url "$url" --dataset "$(post "$raster")" --folder "$work"
