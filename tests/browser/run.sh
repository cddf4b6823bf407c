#!/usr/bin/env bash
# Looks at the viewer in headless Chromium: tests/browser/run.sh BUILD [PICTURES]
#   BUILD      a build folder with bin/cordillera and share/web
#   PICTURES   where the screenshots are left; BUILD/browser by default
# Exits with 77, and says what is missing, where it cannot run.
# The shipped sample and, as a control that the test can fail, a flat raster are posted to a server of its own.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/browser/run.sh BUILD [PICTURES]}" && pwd)
. "$here/../real_server.sh" 'The browser test'
need_node gdal_create gdal_translate gdal_viewshed
need_chromium
[[ -e $build/share/web/complete ]] || leave_out "the viewer in $build/share/web"
pictures=${2:-$build/browser}
modules=$build/browser/npm
mkdir -p "$pictures"
node_modules "$here" "$modules"
cp "$here"/*.mjs "$modules"

server_data=$work/empty start_server "$build"
empty=$url
sample=$repository/deploy/sample/white_mountains_srtm3.tif
# One whose blocks are made where people look. It has a server of its own, for its job goes on as long as they do.
gdal_translate -q -outsize 2600 1800 -r bilinear "$sample" "$work/fine.tif"
server_data=$work/lazy start_server "$build" --build lazy
lazy=$(post "$work/fine.tif") lazy_url=$url
# What the page itself is to post: some of the sample. And a folder of finished tiles of it.
gdal_translate -q -srcwin 300 200 200 200 "$sample" "$work/part.tif"
"$cordillera" build "$work/part.tif" -o "$work/folder" --formats 3d-tiles,relief --quiet
start_server "$build" --mount "folder=$work/folder"
gdal_create -q -of GTiff -ot Int16 -outsize 150 150 -bands 1 -burn 500 -a_srs EPSG:4326 -a_ullr 10 46.15 10.15 46 "$work/flat_ground_at_500_metres_in_the_alps.tif"
terrain=$(post "$sample")
flat=$(post "$work/flat_ground_at_500_metres_in_the_alps.tif")
# Across the antimeridian.
gdal_create -q -of GTiff -ot Int16 -outsize 150 150 -bands 1 -burn 500 -a_srs EPSG:4326 -a_ullr 179.925 46.15 180.075 46 "$work/across.tif"
across=$(post "$work/across.tif")
# Around the pole, where Web Mercator has ended.
gdal_create -q -of GTiff -ot Int16 -outsize 40 40 -bands 1 -burn 500 -a_srs EPSG:3413 -a_ullr -20000 20000 20000 -20000 "$work/polar.tif"
polar=$(post "$work/polar.tif")

# Two uploads that fail: what is no raster is found out by the build.
printf 'no raster' >"$work/bad.tif"
broken() { curl -sS -T "$work/bad.tif" -X POST "$url/v1/datasets?name=$1" | json_id; }
failed=$(broken bad.tif),$(broken worse.tif)
until [[ $(curl -fsS "$url/v1/datasets" | grep -c '"state": "failed"') -eq 2 ]]; do
  kill -0 "$server_pid"
  sleep 0.1
done

# One that is being built, and waits for the test.
. "$here/../held.sh"
hold "$sample" --error 1 --pixels lattice  # meeting every pixel would take five times as long

curl -fsS -o "$work/manifest.json" "$url/v1/datasets/$terrain/manifest.json"
python3 "$here/known_heights.py" "$sample" "$work/manifest.json" >"$work/known.json"
node "$modules/look.mjs" --chromium "$chromium" --url "$url" --empty "$empty" --terrain "$terrain" --flat "$flat" --across "$across" --polar "$polar" --failed "$failed" --known "$work/known.json" \
  --folder folder --raster "$work/part.tif" --bad "$work/bad.tif" --held "$held" --job "$held_job" --lazy "$lazy" --lazy-url "$lazy_url" --fine "$work/fine.tif" --pictures "$pictures"
