#!/usr/bin/env bash
# A raster, its plan, the results of its tasks and the dataset in object storage, and a server that reads it there: tests/storage/run.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/storage/run.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of object storage'
. "$here/storage.sh"
need_node
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
echo "object storage: $all tiles, $(grep -c ^GET "$storage_log") reads"
