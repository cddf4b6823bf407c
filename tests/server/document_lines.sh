#!/usr/bin/env bash
# Runs the shell lines of README.md and docs as a reader would, against a real server: tests/server/document_lines.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/document_lines.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of the lines in documents'
for program in curl gdal_translate; do command -v "$program" >/dev/null || leave_out "$program"; done
start_server "$build"

# What the documents take for granted: the reader's raster, a tile, meshes and a file of options. The raster is the part of the sample
# that has the places and tiles of the documents, so that a dozen builds take seconds.
mkdir "$work/given"
gdal_translate -q -projwin -71.56 44.31 -71.16 44.09 "$repository/deploy/sample/white_mountains_srtm3.tif" "$work/given/dem.tif"
gdal_translate -q -projwin -71.40 44.22 -71.36 44.19 "$work/given/dem.tif" "$work/given/patch.tif"
gdal_translate -q -ot Byte -scale -b 1 -b 1 -b 1 "$work/given/dem.tif" "$work/given/photo.tif"
gdal_translate -q -of EHdr "$work/given/dem.tif" "$work/given/dem.bil"
id=$(post "$work/given/dem.tif")
curl -fsS -o "$work/given/tile.drc" "$url/v1/datasets/$id/tiles/10/617/763.drc"
"$build/bin/cordillera" export "$work/data/datasets/$id" -o "$work/given/in.ply" --level 8 --quiet
"$build/bin/cordillera" simplify "$work/given/in.ply" -o "$work/given/in.off" --keep 0.5 >/dev/null
printf 'error = 20\n' >"$work/given/terrain.conf"

PATH=$build/bin:$PATH python3 "$here/document_lines.py" "$repository" "$url" "$id" "$work/given"
