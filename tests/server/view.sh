#!/usr/bin/env bash
# A folder of tiles as a dataset of a service, and `cordillera view`: tests/server/view.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/view.sh BUILD}" && pwd)
. "$here/../processes.sh"
program=$build/bin/cordillera
sample=$here/../../deploy/sample/white_mountains_srtm3.tif
export TMPDIR=$work/temporary no_proxy=127.0.0.1 NO_PROXY=127.0.0.1
mkdir "$TMPDIR"
cd "$work"
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
is() { [[ $1 == "$2" ]] || fail "$3: '$2', not '$1'"; }
status() { curl -sS -o body -w '%{http_code}' "$@"; }
refused() { # words that are to be said, mounts
  local code=0
  "$program" serve --listen 127.0.0.1:0 --data never --mount "$2" >said 2>&1 || code=$?
  is 1 "$code" "serve --mount $2"
  grep -q -e "$1" said || fail "serve --mount $2 does not say '$1': $(cat said)"
}
# The viewer's address, as soon as it is said.
view() {
  start "$program" view --no-browser "$@" >seen 2>&1
  until grep -q '^http' seen; do
    kill -0 "$started" || fail "view $*: $(cat seen)"
    sleep 0.1
  done
  url=$(head -1 seen)
}
shut() { # signal
  local code=0
  kill "-$1" "$started"
  wait "$started" || code=$?
  is 0 "$code" 'view, when it is stopped'
  is '' "$(ls "$TMPDIR")" 'what view leaves behind'
}

"$program" build "$sample" -o 'My DEM' --error 60 --formats drc,3d-tiles,terrain-rgb -q
"$program" build "$sample" -o dem.sqlite --error 60 -q

# A mount that can never be served ends the start, with its name.
mkdir empty
printf 'SQLite format 3\0 and nothing else' >broken.sqlite
refused 'dataset x: there is no nothing' x=nothing
refused 'empty holds neither manifest.json nor dataset.sqlite' x=empty
refused 'dataset x: ' x=broken.sqlite
refused 'dataset x: ' "x=$sample"
sql() { python3 -c 'import sqlite3, sys; sqlite3.connect(sys.argv[1]).executescript(sys.argv[2])' "$@"; }
endless='WITH RECURSIVE r(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM r)'
cp dem.sqlite code.sqlite
sql code.sqlite "ALTER TABLE blobs RENAME TO b0; CREATE VIEW blobs AS $endless SELECT b0.* FROM b0, r WHERE r.n < 0"
refused 'what would run while it is read: view blobs' x=code.sqlite

# The folder's own files are the answers; what it does not hold is told apart from a tile that does not exist.
view 'My DEM/' dem.sqlite
all=${url}v1/datasets one=${url}v1/datasets/my-dem
is 'dem my-dem' "$(curl -s "$all" | python3 -c 'import json, sys; print(*sorted(d["id"] for d in json.load(sys.stdin)["datasets"]))')" 'the datasets'
count=0
while read -r path; do
  [[ $path == index.html || $path == terrain-rgb.json ]] && continue  # a server puts its own address into the latter
  is 200 "$(status "$one/$path")" "$path"
  cmp -s body "My DEM/$path" || fail "$path has other bytes"
  count=$((count + 1))
done < <(cd 'My DEM' && find . -type f -size -1000k | sed 's|^\./||' | sort | awk 'NR % 7 == 0 || /json$/')
((count > 10)) || fail "only $count files"
is 200 "$(status "$one/terrain-rgb.json")" 'TileJSON'
grep -q "\"$one/terrain-rgb/{z}/{x}/{y}.png\"" body || fail "addresses of tiles: $(cat body)"
is 304 "$(status "$one/manifest.json" -H "If-None-Match: $(curl -sI "$one/manifest.json" | tr -d '\r' | sed -n 's/^ETag: //ip')")" 'what has not changed'
told() { python3 -c 'import json; print(json.load(open("body"))["type"].split(":")[-1])'; }
for path in tiles/10/0/0.drc:tile-unknown layer.json:not-in-folder 'elevation?points=-71.3,44.2:not-in-folder' mesh.glb:not-in-folder tiles/W/../../manifest.json:not-found versions/1/manifest.json:version-unknown; do
  is 404 "$(status --path-as-is "$one/${path%:*}")" "$path"
  is "${path##*:}" "$(told)" "$path"
done
# What is advertised is there: nothing is made of a folder when it is asked for.
advertised() { python3 -c '
import json, sys
status, item = (json.load(open(name)) for name in sys.argv[1:])
names = sorted(face["name"] for face in status["faces"])
assert names == ["3d-tiles", "drc", "terrain-rgb"] == sorted(set(item["assets"]) - {"manifest"}), (names, item["assets"].keys())
assert not {"mesh", "pmtiles", "version"} & set(status["links"]), status["links"]
hrefs = list(status["links"].values()) + [link["href"] for face in status["faces"] for link in face["links"]] + [asset["href"] for asset in item["assets"].values()]
print(*sorted({href[href.index("/v1/"):] for href in hrefs if "{" not in href and not href.endswith("/events")}), sep="\n")' status.json item.json; }
curl -s "$one" >status.json
curl -s "${url}stac/collections/datasets/items/my-dem" >item.json
paths=$(advertised) || fail "links of a folder: $(cat status.json)"
while read -r path; do
  is 200 "$(status "${url%/}$path")" "the link $path"
done <<<"$paths"
is 405 "$(status -X DELETE "$one")" 'deleting a folder'
[[ -e 'My DEM/manifest.json' ]] || fail 'the folder is gone'
is 200 "$(status "${url}v1/datasets/dem/elevation?points=-71.3,44.2")" 'heights of the file beside it'
is 1 "$(curl -sI "$one/tiles/10/617/763.drc" | grep -ic '^content-type')" 'types of a tile'
shut INT

# Archives of tiles: a .3tz, and a zip of a folder, wherever the folder lies in it.
"$program" export dem.sqlite -o dem.3tz -q
"$program" export dem.sqlite -o dem.pmtiles -q
python3 -m zipfile -c folder.zip 'My DEM'
view dem.3tz folder.zip
is 'dem folder' "$(curl -s "${url}v1/datasets" | python3 -c 'import json, sys; print(*sorted(d["id"] for d in json.load(sys.stdin)["datasets"]))')" 'the datasets of archives'
for path in dem/tileset.json folder/tileset.json folder/manifest.json; do
  is 200 "$(status "${url}v1/datasets/$path")" "$path of an archive"
done
cmp -s body 'My DEM/manifest.json' || fail 'the folder of the zip has another manifest'
tile=$(python3 -m zipfile -l dem.3tz | sed -n 's/ .*//; /glb$/p' | tail -1)
is 200 "$(status "${url}v1/datasets/dem/$tile")" 'a tile of the .3tz'
python3 -c 'import sys, zipfile; sys.stdout.buffer.write(zipfile.ZipFile("dem.3tz").read(sys.argv[1]))' "$tile" | cmp -s body - || fail 'a tile of the .3tz has other bytes'
shut INT

# Archives of tiles for maps: the page of a map shows them, and an archive beside meshes has its own line. So does a folder without meshes.
"$program" export dem.sqlite -o map.mbtiles --format contours -q
"$program" build "$sample" -o heights --error 60 --formats terrarium -q
view dem.pmtiles map.mbtiles heights
is 'dem heights map' "$(curl -s "${url%%/v1/*}/v1/datasets" | python3 -c 'import json, sys; print(*sorted(d["id"] for d in json.load(sys.stdin)["datasets"]))')" 'the datasets of archives'
is "$(sed -n 's|.*/datasets/||p' seen | tr '\n' ' ')" 'dem/demo/maplibre.html map/demo/maplibre.html heights/demo/maplibre.html ' 'the pages of maps'
datasets=${url%/dem/*}
is 200 "$(status "$datasets/dem/terrain-rgb.json")" 'heights of a .pmtiles'
grep -q '"encoding": "mapbox"' body || fail "TileJSON of a .pmtiles: $(cat body)"
"$program" export dem.sqlite -o dem.mbtiles -q
tile=$(python3 -c '
import sqlite3
z, x, row, data = sqlite3.connect("dem.mbtiles").execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles ORDER BY length(tile_data) DESC").fetchone()
open("tile.png", "wb").write(data)
print(f"{z}/{x}/{2 ** z - 1 - row}")')
is 200 "$(status "$datasets/dem/terrain-rgb/$tile.png")" 'a tile of a .pmtiles'
cmp -s body tile.png || fail 'a tile of a .pmtiles has other bytes than the .mbtiles'
is 200 "$(status "$datasets/map/contours.json")" 'contours of an .mbtiles'
shut INT
view dem.3tz dem.pmtiles
is "$(grep -c '^http' seen)" 2 'a line for the viewer and one for the map'
shut INT
"$program" info dem.pmtiles >said 2>&1 || fail "info of a .pmtiles: $(cat said)"
"$program" info dem.3tz >said 2>&1 && fail 'info takes a .3tz for a raster'
grep -q 'cordillera view dem.3tz' said || fail "info of a .3tz: $(cat said)"
"$program" export dem.sqlite -o meshes.pmtiles --format drc -q
code=0
"$program" view --no-browser meshes.pmtiles >said 2>&1 || code=$?
is 1 "$code" 'view of meshes in a .pmtiles'
grep -q 'holds drc tiles' said || fail "view of meshes in a .pmtiles: $(cat said)"
is '' "$(ls "$TMPDIR")" 'what view leaves behind'

# A signal while an archive is unpacked: here one whose rows take a second each. What a killed process left goes at the next start.
sql slow.mbtiles "CREATE TABLE metadata(name, value); CREATE VIEW tiles AS $endless SELECT 8 AS zoom_level, 0 AS tile_column, 9 AS tile_row, x'00' AS tile_data FROM r WHERE n % 20000000 = 0"
for signal in TERM KILL; do
  start "$program" view --no-browser slow.mbtiles >seen 2>&1
  until [[ -n $(ls "$TMPDIR") ]]; do
    kill -0 "$started" || fail "view of a slow archive: $(cat seen)"
    sleep 0.1
  done
  code=0
  kill "-$signal" "$started"
  wait "$started" || code=$?
  [[ $signal == KILL ]] || is 1 "$code" 'view that is stopped while it unpacks'
  [[ $signal == KILL ]] || grep -q 'slow.mbtiles was stopped' seen || fail "view that is stopped while it unpacks: $(cat seen)"
  [[ $signal == KILL ]] || is '' "$(ls "$TMPDIR")" 'what view leaves behind when it is stopped while it unpacks'
done
[[ -n $(ls "$TMPDIR") ]] || fail 'a killed process left nothing'
"$program" view nothing.tif >said 2>&1 || true
is '' "$(ls "$TMPDIR")" 'what a killed view left, at the next start'

# A raster is built for the while.
view "$sample" --error 60
is 200 "$(status "${url}v1/datasets")" 'a raster'
until grep -q ' is ready$' seen; do
  kill -0 "$started" || fail "view of a raster: $(cat seen)"
  sleep 0.1
done
shut HUP

# In the middle of a build, too, and at once.
view "$sample" --error 0.1
shut INT
printf 'no raster' >bad.tif
code=0
"$program" view --no-browser bad.tif >said 2>&1 || code=$?
is 1 "$code" 'view of what is no raster'
grep -q 'bad.tif is text, not a raster' said || fail "view of what is no raster: $(cat said)"
code=0
"$program" view nothing.tif >said 2>&1 || code=$?
is 1 "$code" 'view of nothing'
is '' "$(ls "$TMPDIR")" 'what view leaves behind'
