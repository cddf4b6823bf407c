#!/usr/bin/env bash
# Runs the code of the client pages (docs) as it stands, in headless Chromium and Node.js:
#   tests/browser/clients/run.sh BUILD [PICTURES]
#   BUILD      a build folder with bin/cordillera
#   PICTURES   where the screenshots are left; BUILD/browser/clients by default
#   ONLY=NAME,NAME in the environment: only these clients
#   CORDILLERA_ALL_TESTS=1, as tests/run.sh --all has it: all of them. Else the first of each library, one page with its events, and all without a browser
# Exits with 77, and says what is missing, where it cannot run.
# The shipped sample and, as a control that the test can fail, a flat raster in its place are posted to a server of its own.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/browser/clients/run.sh BUILD [PICTURES]}" && pwd)
. "$here/../../real_server.sh" 'The client test'
first_of_each=cesium-3d-tiles,cesium-terrain,three-3d-tiles,deck-3d-tiles,maplibre,openlayers,leaflet,demo-high,demo-live,demo-lazy,demo-private
first_of_each+=,loaders-gl-draco,loaders-gl-quantized-mesh,loaders-gl-3d-tiles,pmtiles,drc-program
need_node gdal_create gdal_translate
need_chromium
pictures=${2:-$build/browser/clients}
mkdir -p "$pictures"
pictures=$(cd "$pictures" && pwd)
modules=$build/browser/clients-npm
node_modules "$here" "$modules"
mkdir -p "$modules/clients"
cp "$here"/../browser.mjs "$modules"
cp -r "$here"/*.mjs "$here/drivers" "$modules/clients"

# The same place, size and pixels as the sample's, without its relief.
token=$("$build/bin/cordillera" token new --name test --role write --file "$work/tokens" 2>/dev/null | sed -n 's/^token: //p')
sample=$repository/deploy/sample/white_mountains_srtm3.tif
# One whose blocks are made where people look. It has a server of its own, for its job goes on as long as they do.
gdal_translate -q -outsize 2600 1800 -r bilinear "$sample" "$work/fine.tif"
server_data=$work/lazy start_server "$build" --build lazy
lazy=$(post "$work/fine.tif") lazy_url=$url
start_server "$build" --tokens "$work/tokens"
export CORDILLERA_TOKEN=$token
gdal_create -q -of GTiff -ot Int16 -outsize 960 540 -bands 1 -burn 500 -a_srs EPSG:4326 -a_ullr -71.85 44.5 -71.05 44.05 "$work/flat.tif"
# post_as RASTER PARAMETERS: with parameters of a request.
post_as() { curl -fsS -T "$1" -X POST -H "Authorization: Bearer $token" -H 'Prefer: wait=300' "$url/v1/datasets?name=${1##*/}&$2" | json_id; }
terrain=$(post_as "$sample" attribution=Surveyors)
flat=$(post "$work/flat.tif")
gdal_translate -q -a_ullr 179.6 44.5 180.4 44.05 "$sample" "$work/across.tif"
across=$(post "$work/across.tif")
# A kilometre of ground that is twice as high.
gdal_translate -q -ot Float32 -scale 0 2000 2000 2500 -srcwin 300 200 200 200 -a_ullr 8.743 46.584 8.757 46.574 "$sample" "$work/high.tif"
high=$(post "$work/high.tif")
gdal_translate -q -srcwin 300 200 200 200 "$sample" "$work/part.tif"
hidden=$(post_as "$work/part.tif" private=1)
for id in "$terrain" "$flat"; do
  mkdir -p "$work/archives/$id"
  "$build/bin/cordillera" export "$work/data/datasets/$id" -o "$work/archives/$id/dem.pmtiles" >/dev/null
  "$build/bin/cordillera" export "$work/data/datasets/$id" -o "$work/archives/$id/drc.pmtiles" --format drc >/dev/null
done

# One that is being built, and waits for the test.
. "$here/../../held.sh"
hold "$sample" --error 1 --pixels lattice  # meeting every pixel would take five times as long

# A folder of tiles, below a plain web server; and in a viewer of its own, beside an archive of tiles for maps (dem).
first_line() { until [[ -s $1 ]]; do kill -0 "$started" || return 1; sleep 0.1; done; head -1 "$1"; }
"$build/bin/cordillera" build "$sample" -o "$work/folder" -q
start python3 -u -m http.server 0 --bind 127.0.0.1 --directory "$work/folder" >"$work/plain" 2>/dev/null
plain=$(first_line "$work/plain" | sed 's/.*(\(http.*\)\/).*/\1/')
start "$build/bin/cordillera" view --no-browser "$work/folder" "$work/archives/$terrain/dem.pmtiles" >"$work/view"
viewer=$(first_line "$work/view")

: "${ONLY:=${CORDILLERA_ALL_TESTS:-$first_of_each}}"
[[ $ONLY != "${CORDILLERA_ALL_TESTS:-}" ]] || ONLY=

curl -fsS -o "$work/manifest.json" "$url/v1/datasets/$terrain/manifest.json"
python3 "$here/../known_heights.py" "$sample" "$work/manifest.json" >"$work/known.json"
node "$modules/clients/look.mjs" --chromium "$chromium" --url "$url" --terrain "$terrain" --flat "$flat" --across "$across" --high "$high" \
  --known "$work/known.json" --archives "$work/archives" \
  --docs "$repository/docs" --modules "$modules/node_modules" \
  --pictures "$pictures" --private "$hidden" --token "$token" --held "$held" --job "$held_job" --lazy "$lazy" --lazy-url "$lazy_url" --plain "$plain" --viewer "$viewer" ${ONLY:+--only "$ONLY"}
