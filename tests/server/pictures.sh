#!/usr/bin/env bash
# Holds the pixels of Terrain-RGB, Terrarium and hillshade against the raster itself, those of the styles against gdaldem, and contours
# against gdal_contour:
#   tests/server/pictures.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/pictures.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of pictures'
for program in curl gdalwarp gdaldem gdal_contour gdal_translate ogr2ogr; do command -v "$program" >/dev/null || leave_out "$program"; done
start_server "$build" --error 2
gdal_translate -q -projwin -71.84 44.49 -71.06 44.06 "$repository/deploy/sample/white_mountains_srtm3.tif" "$work/dem.tif"
id=$(post "$work/dem.tif")
python3 "$here/pictures.py" "$work/dem.tif" "$url/v1/datasets/$id" "$work"
python3 "$here/styles.py" "$url/v1/datasets/$id" "$work"
python3 "$here/contours.py" "$url/v1/datasets/$id" "$work"
