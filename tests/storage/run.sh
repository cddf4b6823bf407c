#!/usr/bin/env bash
# A raster, its plan, the results of its tasks and the dataset in object storage, and a server that reads it there: tests/storage/run.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/storage/run.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of object storage'
. "$here/storage.sh"
need_node gdal_translate
need_storage "$here" "$build"
start_storage "$work/storage"

program=$build/bin/cordillera
sample=$repository/deploy/sample/white_mountains_srtm3.tif
fail() { echo "FAILED: $*" >&2; tail -n 20 "$work/server.log" >&2 || true; exit 1; }
expect() { [[ $1 == "$2" ]] || fail "$3: $1 instead of $2"; }
code_of() { local code=0; "$@" >"$work/said" 2>&1 || code=$?; echo $code; }

# fetch_all FOLDER: asks for every tile that the folder has; prints how many answers were the folder's bytes, 503 with Retry-After, and anything else.
fetch_all() {
  (cd "$1" && find . -name '*.drc' -o -name '*.glb' | sed 's|^\./||') >"$work/tiles"
  rm -rf "$work/got"
  mkdir "$work/got"
  awk -v url="$url/v1/datasets/bucket/" -v got="$work/got/" '{ n = $0; gsub("/", "+", n); print "url = \"" url $0 "\"\noutput = \"" got n "\"" }' \
    "$work/tiles" >"$work/urls"
  curl -s --parallel --parallel-max 6 -w '%{http_code} %{filename_effective} %header{retry-after}\n' -K "$work/urls" >"$work/answers"
  local same=0 unreachable=0 other=0 status file retry
  while read -r status file retry; do
    if [[ $status == 200 ]] && cmp -s "$file" "$1/$(basename "$file" | tr + /)"; then same=$((same + 1))
    elif [[ $status == 503 && -n $retry ]] && grep -q storage-unreachable "$file"; then unreachable=$((unreachable + 1))
    else other=$((other + 1)); fi
  done <"$work/answers"
  echo "$same $unreachable $other"
}
# come_to FOLDER ANSWERS WHAT: the server looks again every few seconds; the time never decides.
come_to() {
  local seen end=$((SECONDS + 240))
  until seen=$(fetch_all "$1"); [[ $seen == "$2" ]]; do
    ((SECONDS < end)) || fail "$3: $seen instead of $2"
    sleep 0.5
  done
}

curl -fsS -T "$sample" "$storage_url/dem.tif" || fail 'the storage takes no file'
# make ERROR: a plan of the raster in the bucket, its tasks, and the dataset; the same here, as a folder.
make() {
  "$program" build "$sample" -o "$work/here-$1" --error "$1" --name dem -q
  "$program" plan /vsis3/terrain/dem.tif -o "/vsis3/terrain/plan-$1" --error "$1" --name dem -q
  "$program" work "/vsis3/terrain/plan-$1" -q
  "$program" publish "/vsis3/terrain/plan-$1" -o /vsis3/terrain/dem.sqlite -q "${@:2}"
}
# Parts of a large object are sent one after the other; so small, these few megabytes have some.
VSIS3_CHUNK_SIZE=1 make 0.5
grep -q '^POST 200 /terrain/dem.sqlite' "$storage_log" || fail 'dem.sqlite was not sent in parts'
# Tasks that are done are counted by listing them, not one by one.
before=$(wc -l < "$storage_log")
"$program" tasks /vsis3/terrain/plan-0.5 > "$work/said"
! tail -n "+$((before + 1))" "$storage_log" | grep '[.]shard' || fail 'tasks asks for each shard'
all=$(find "$work/here-0.5" -name '*.drc' -o -name '*.glb' | wc -l)
((all >= 50)) || fail "only $all tiles"

echo '== served from the bucket'
start_server "$build" --mount bucket=/vsis3/terrain/dem.sqlite --cache-size 1
expect "$(fetch_all "$work/here-0.5")" "$all 0 0" 'tiles'
[[ $(curl -fsS "$url/v1/datasets") == *'"id": "bucket"'* ]] || fail 'the list lacks it'
expect "$(curl -s -o /dev/null -w '%{http_code}' -X DELETE "$url/v1/datasets/bucket")" 405 'DELETE'
grep -q '^GET 206 /terrain/dem.sqlite' "$storage_log" || fail 'nothing was read by ranges'

echo '== a raster of the bucket, fetched by the service'
stop "$server_pid" || true
start_server "$build" --mount bucket=/vsis3/terrain/dem.sqlite --cache-size 1 --source-allow s3://terrain/
post() { curl -s -o "$work/said" -w '%{http_code}' -X POST -H 'Prefer: wait=120' "$url/v1/datasets?error=60&updates=1&source=$1"; }
expect "$(post s3://terrain/dem.tif)" 201 'a raster of the bucket'
expect "$(post s3://elsewhere/dem.tif)" 403 'a raster of another bucket'
post s3://terrain/none.tif >"$work/status"
grep -q source-unreachable "$work/said" || fail "an object that is not there: $(cat "$work/status" "$work/said")"

echo '== what publish refuses'
expect "$(code_of "$program" publish /vsis3/terrain/plan-0.5 -o /vsis3/terrain/dem.sqlite)" 1 'publish over another'
grep -q 'is there already' "$work/said" || fail 'no word about the other'
expect "$(code_of "$program" publish /vsis3/terrain/plan-0.5 -o /vsis3/terrain/folder)" 2 'publish as a folder'

echo '== the storage is killed, and comes back'
kill_storage
read -r same unreachable other < <(fetch_all "$work/here-0.5")
((other == 0 && unreachable > 0)) || fail "without the storage: $same right, $unreachable unreachable, $other others"
curl -fsS -o /dev/null "$url/healthz" || fail 'the server is gone'
expect "$(code_of "$program" publish /vsis3/terrain/plan-0.5 -o /vsis3/terrain/other.sqlite)" 75 'publish without the storage'
start_storage "$work/storage"
come_to "$work/here-0.5" "$all 0 0" 'tiles after the storage came back'  # what was tried in vain is tried again after some seconds

echo '== another dataset takes its place'
make 60 --overwrite
come_to "$work/here-60" "$(find "$work/here-60" -name '*.drc' -o -name '*.glb' | wc -l) 0 0" 'tiles of the new one'
grep -q 'another one has been published' "$work/server.log" || fail 'the server does not say so'

echo '== nothing is there at the start'
stop "$server_pid" || true
curl -fsS -X DELETE "$storage_url/dem.sqlite"
start_server "$build" --mount bucket=/vsis3/terrain/dem.sqlite
expect "$(curl -s -o /dev/null -w '%{http_code}' "$url/v1/datasets/bucket/manifest.json")" 503 'a dataset that is not there'
"$program" publish /vsis3/terrain/plan-0.5 -o /vsis3/terrain/dem.sqlite -q
come_to "$work/here-0.5" "$all 0 0" 'tiles, published after the start'

echo '== a COG of the bucket: read by ranges, and asked for again'
gdal_translate -q -of COG -outsize 6000 6000 -r cubic -co COMPRESS=DEFLATE "$sample" "$work/large.tif"
curl -fsS -T "$work/large.tif" "$storage_url/large.tif" || fail 'the storage takes no large file'
stop "$server_pid" || true
start_server "$build" --source-allow s3://terrain/ --live-fresh 1
live() { curl -fsSL --retry 20 --retry-all-errors --retry-delay 1 -G -o "$work/said" --data-urlencode url=s3://terrain/large.tif -d error=60 "$url/v1/live$1"; }
live /tileset.json || fail "the COG of the bucket: $(cat "$work/said")"
# What was sent of it so far, and how often its service asked whether it is the same.
sent() { awk '$1 == "GET" && $3 == "/terrain/large.tif" { sum += $4 } END { print sum + 0 }' "$storage_log"; }
answers() { grep -c "^GET $1 /terrain/large.tif" "$storage_log" || true; }
(($(answers 206) > 0 && $(sent) * 2 < $(stat -c %s "$work/large.tif"))) || fail "it was read whole: $(sent) bytes, $(answers 206) parts"
end=$((SECONDS + 240))
until live /manifest.json && (($(answers 304) > 0)); do ((SECONDS < end)) || fail 'it was not asked for again'; sleep 0.5; done
mkdir "$work/other"
gdal_translate -q -of COG -outsize 6000 6000 -r cubic -projwin -71.56 44.31 -71.16 44.09 -co COMPRESS=DEFLATE "$sample" "$work/other/large.tif"
curl -fsS -T "$work/other/large.tif" "$storage_url/large.tif" || fail 'the storage takes no other file'
before=$(python3 -c 'import json, sys; print(json.load(sys.stdin)["bounds"])' <"$work/said")
until live /manifest.json && [[ $(python3 -c 'import json, sys; print(json.load(sys.stdin)["bounds"])' <"$work/said") != "$before" ]]; do
  ((SECONDS < end)) || fail 'another object was not found'
  sleep 0.5
done

echo "object storage: $all tiles, $(grep -c ^GET "$storage_log") reads"
