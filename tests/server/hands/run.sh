#!/usr/bin/env bash
# HTTP as hands type it, against a real server: curl lines, npm's pmtiles and tus-js-client, a reader of STAC: tests/server/hands/run.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/hands/run.sh BUILD}" && pwd)
. "$here/../../real_server.sh" 'The test of HTTP by hand'
need_node gdal_translate
modules=$build/hands
node_modules "$here" "$modules"
cp -r "$here/check.mjs" "$here/resume.mjs" "$here/schemas" "$modules"
sample=$repository/deploy/sample/white_mountains_srtm3.tif
gdal_translate -q -srcwin 0 0 300 200 "$sample" "$work/west.tif"
gdal_translate -q -srcwin 280 0 300 200 "$sample" "$work/east.tif"

fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
# is WANTED GOT ABOUT
is() { [[ $2 == "$1" ]] || fail "$3: $2 instead of $1"; }
like() { [[ $2 =~ $1 ]] || fail "$3: $2"; }
status() { curl -s -o "$work/body" -w '%{http_code}' "$@"; }
header() { curl -s -o /dev/null -D - "${@:2}" | tr -d '\r' | sed -n "s/^$1: //Ip"; }
member() { python3 -c 'import json, sys; value = json.load(open(sys.argv[1]))
for name in sys.argv[2:]: value = value[int(name) if isinstance(value, list) else name]
print(json.dumps(value) if isinstance(value, (dict, list, bool)) or value is None else value)' "$work/body" "$@"; }

for person in ann ben rae; do
  role=write
  [[ $person != rae ]] || role=read
  declare "$person=Authorization: Bearer $("$build/bin/cordillera" token new --name $person --role $role --file "$work/tokens" 2>/dev/null | sed -n 's/^token: //p')"
done
files_port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
start python3 -m http.server --bind 127.0.0.1 --directory "$work" "$files_port" >"$work/files.log" 2>&1
until curl -fs -o /dev/null "http://127.0.0.1:$files_port/west.tif"; do sleep 0.1; done
start_server "$build" --tokens "$work/tokens" --source-allow "http://127.0.0.1:$files_port/"
sets=$url/v1/datasets
quick='error=100&provisional=0'
ready=(-H "$ann" -H 'Prefer: wait=300')

# A form with one file, fields as options; -T alone, a name behind the slash; JSON with an address, which asks for nothing else.
is 201 "$(status "${ready[@]}" -F file=@"$work/west.tif" -F error=100 -F title=Hills "$sets")" 'a form'
one=$(member id)
is Hills "$(member manifest title)" 'a field of the form'
is 201 "$(status "${ready[@]}" -T "$work/west.tif" "$sets?$quick")" 'PUT on the collection'
is 201 "$(status "${ready[@]}" -T "$work/west.tif" "$sets/?$quick")" 'PUT with a slash'
is west.tif "$(member name)" 'the name that curl puts behind the slash'
is 201 "$(status "${ready[@]}" --json '{"source": "http://127.0.0.1:'"$files_port"'/west.tif", "error": 100}' "$sets")" 'JSON: source= alone'
is 200 "$(status -L "$sets/$one/")" 'a slash too many'
count=4

# Several files of one form are one dataset of several rasters; the first wins.
is 201 "$(status "${ready[@]}" -F file=@"$work/east.tif" -F file=@"$work/west.tif" -F error=100 "$sets")" 'a form of two files'
both=$(member id)
count=$((count + 1))
is 200 "$(status "$sets/$both/sources")" 'its sources'
is 'east.tif west.tif' "$(member sources 0 name) $(member sources 1 name)" 'the rasters in their order'
is 200 "$(status "$sets/$both/elevation?points=-71.8,44.45;-71.4,44.45")" 'heights in both'
[[ $(member points 0 ellipsoidal_height) != null && $(member points 1 ellipsoidal_height) != null ]] || fail 'one of two rasters has no heights'

# Links are paths below the prefix that a proxy told.
status -H 'X-Forwarded-Prefix: /terrain' "$sets/$one" >/dev/null
is "/terrain/v1/datasets/$one" "$(member links self)" 'a link behind a proxy'
status "$sets?limit=1" >/dev/null
is "/v1/datasets/$both" "$(member datasets 0 links self)" 'a link of the list'
is 200 "$(status "$url$(member next)")" 'the next page'
location=$(header Location "${ready[@]}" -T "$work/west.tif" "$sets?$quick&name=other")
like '^/v1/datasets/other-' "$location" 'Location'
is 204 "$(status -X DELETE -H "$ann" "$url$location")" 'deleting it'

# Pages of other origins may write where a token is needed; what they may send is named.
preflight=(-X OPTIONS -H 'Origin: https://example.org' -H 'Access-Control-Request-Method: POST')
like 'POST, PUT' "$(header Access-Control-Allow-Methods "${preflight[@]}" "$sets")" 'methods of a preflight'
like 'Content-Type.*Prefer.*Idempotency-Key.*Upload-Offset' "$(header Access-Control-Allow-Headers "${preflight[@]}" "$sets")" 'headers of a preflight'
like 'PATCH, DELETE' "$(header Access-Control-Allow-Methods "${preflight[@]}" "$sets/$one")" 'methods of a dataset'

# Title, attribution and who may read change without a build, for the owner alone.
old=$(curl -s "$sets/$one" | python3 -c 'import json, sys; print(json.load(sys.stdin)["version"])')
is 401 "$(status -X PATCH --json '{"title": "Hills, mended"}' "$sets/$one")" 'PATCH of a stranger'
is 403 "$(status -X PATCH -H "$ben" --json '{"title": "Hills, mended"}' "$sets/$one")" 'PATCH of another'
is 200 "$(status -X PATCH -H "$ann" --json '{"title": "Hills, mended", "attribution": "SRTM"}' "$sets/$one")" 'PATCH'
is 'Hills, mended' "$(member manifest title)" 'the new title'
[[ $(member version) != "$old" ]] || fail 'other documents have the same version'
status "$sets/$one/tileset.json" >/dev/null
like 'SRTM' "$(cat "$work/body")" 'the new attribution in a document'
is 200 "$(status -X PATCH -H "$ann" "$sets/$one?private=1")" 'PATCH by query'
is 404 "$(status "$sets/$one")" 'a private dataset'
is 404 "$(status "$url/stac/collections/datasets/items/$one")" 'its item, for strangers'
is 404 "$(status "$sets/$one.pmtiles")" 'its archive, for strangers'
is 200 "$(status -H "$rae" "$url/stac/collections/datasets/items/$one")" 'its item, for who may read'
status "$url/stac/collections/datasets/items?limit=100" >/dev/null
is $((count - 1)) "$(member numberReturned)" 'items for strangers'
is 200 "$(status -X PATCH -H "$ann" --json '{"private": false}' "$sets/$one")" 'public again'

# Progress: one share that never falls, and a place in the queue. It is heard from before its turn: a build that is held has that first.
. "$here/../../held.sh"
CORDILLERA_TOKEN=${ann##* } hold "$sample" --error 1 --pixels lattice  # meeting every pixel would take five times as long
next=$(curl -s -H "$ann" -T "$sample" "$sets?error=5&provisional=0" | json_id)
start curl -s -N -H 'Accept: text/event-stream' "$sets/$next/events" >"$work/events"
until grep -q '"stage":"queued"' "$work/events"; do
  kill -0 "$started" || fail "the queue is not told of: $(cat "$work/events")"
  sleep 0.1
done
resume_held
wait "$started" || fail 'the events broke off'
python3 - "$work/events" <<'END'
import json, sys
lines = open(sys.argv[1]).read().split("\n")
told = [json.loads(line[6:]) for before, line in zip(lines, lines[1:]) if before == "event: progress"]
shares = [one["share"] for one in told]
assert shares == sorted(shares) and shares[-1] > 0.1, shares
assert told[0]["place"] is not None and told[-1]["place"] is None, told
assert len({one["stage"] for one in told}) > 1, told
END
count=$((count + 2))

# Ranges of a mesh: a part, the rest of a download that broke off, the wrong tag, behind the end.
mesh=$sets/$one/mesh.glb
curl -s -o "$work/mesh.glb" "$mesh"
size=$(stat -c %s "$work/mesh.glb")
tag=$(header ETag "$mesh")
is 206 "$(status -r 100-199 "$mesh")" 'a range'
cmp -s "$work/body" <(tail -c +101 "$work/mesh.glb" | head -c 100) || fail 'other bytes than the range'
is "bytes 100-199/$size" "$(header Content-Range -r 100-199 "$mesh")" 'Content-Range'
head -c 1000 "$work/mesh.glb" >"$work/resumed.glb"
curl -s -C - -o "$work/resumed.glb" "$mesh"
cmp -s "$work/resumed.glb" "$work/mesh.glb" || fail 'curl -C - gives another file'
is 206 "$(status -r -5 -H "If-Range: $tag" "$mesh")" 'If-Range that holds'
is 200 "$(status -r -5 -H 'If-Range: "other"' "$mesh")" 'If-Range that does not'
is 304 "$(status -r -5 -H "If-None-Match: $tag" "$mesh")" 'If-None-Match before Range'
is 416 "$(status -r "$size-" "$mesh")" 'behind the end'
is "bytes */$size" "$(header Content-Range -r "$size-" "$mesh")" 'the size'
is 200 "$(status -H 'Range: bytes=0-1,4-5' "$mesh")" 'two ranges: the whole'

# The archive: whole, by ranges, its length in a HEAD, and not of a format without tiles.
curl -sf --retry 100 -o "$work/all.pmtiles" "$sets/$one.pmtiles"
like '^PMTiles' "$(head -c 7 "$work/all.pmtiles")" 'the archive'
is "$(stat -c %s "$work/all.pmtiles")" "$(header Content-Length -I "$sets/$one.pmtiles")" 'its length'
curl -sf -r 50- "$sets/$one.pmtiles" | cmp -s - <(tail -c +51 "$work/all.pmtiles") || fail 'the end of the archive'
is 400 "$(status "$sets/$one.pmtiles?format=3d-tiles-explicit2")" 'an unknown format'
is 200 "$(status "$sets/$one.pmtiles?format=drc")" 'another format'

# What browsers and people ask for.
for page in favicon.ico:image/x-icon docs:text/html openapi.json:application/vnd.oai.openapi[+]json version:application/json; do
  like "^${page#*:}" "$(header Content-Type "$url/${page%%:*}")" "/${page%%:*}"
done

node "$modules/resume.mjs" --url "$url" --file "$work/west.tif" --token "${ann##* }"
node "$modules/check.mjs" --url "$url" --dataset "$one" --datasets "$count"
echo 'ok  curl lines'
