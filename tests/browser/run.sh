#!/usr/bin/env bash
# Looks at the viewer in headless Chromium: tests/browser/run.sh BUILD [PICTURES]
#   BUILD      a build folder with bin/cordillera and share/web
#   PICTURES   where the screenshots are left; BUILD/browser by default
# Exits with 77, and says what is missing, where it cannot run.
# The shipped sample and, as a control that the test can fail, a flat raster are posted to a server of its own.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
chromium=$(command -v chromium || command -v chromium-browser || true)

export no_proxy=127.0.0.1 NO_PROXY=127.0.0.1
build=$(cd "${1:?usage: tests/browser/run.sh BUILD [PICTURES]}" && pwd)
missing=()
[[ -n $chromium ]] || missing+=(Chromium)
command -v npm >/dev/null || missing+=(npm)
[[ -e $build/share/web/complete ]] || missing+=("the viewer in $build/share/web")
if [[ ${#missing[@]} -gt 0 ]]; then
  printf 'The browser test is left out; missing: %s\n' "$(printf '%s, ' "${missing[@]}" | sed 's/, $//')"
  exit 77
fi
pictures=${2:-$build/browser}
mkdir -p "$pictures"
modules=$build/browser/npm
work=$(mktemp -d)
server=
cleanup() {
  [[ -z $server ]] || { kill -TERM "$server" 2>/dev/null && wait "$server"; } || true
  rm -rf "$work"
}
trap cleanup EXIT

# npm works in a folder of its own, so that a checkout stays clean.
mkdir -p "$modules"
cp "$here"/package.json "$here"/package-lock.json "$modules"
fetch() { (cd "$modules" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null); }
if ! fetch && ! fetch; then
  (cd "$modules" && npm ping >/dev/null 2>&1) && exit 1  # the registry is there: what we ask of it is wrong
  printf 'The browser test is left out; missing: the registry of npm\n'
  exit 77
fi
cp "$here"/*.mjs "$modules"

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
url=http://127.0.0.1:$port
"$build/bin/cordillera" serve --listen "127.0.0.1:$port" --data "$work/data" >"$work/server.log" 2>&1 &
server=$!
until curl -fs -o /dev/null "$url/readyz"; do
  kill -0 "$server" || { cat "$work/server.log" >&2; exit 1; }
  sleep 0.2
done

sample=$root/deploy/sample/white_mountains_srtm3.tif
gdal_create -q -of GTiff -ot Int16 -outsize 300 300 -bands 1 -burn 500 -a_srs EPSG:4326 -a_ullr 10 46.3 10.3 46 "$work/flat.tif"
post() { curl -fsS -T "$1" -X POST -H 'Prefer: wait=300' "$url/v1/datasets?name=$(basename "$1")" | python3 -c 'import json, sys; print(json.load(sys.stdin)["id"])'; }
terrain=$(post "$sample")
flat=$(post "$work/flat.tif")
python3 "$root/deploy/client.py" watch "$url" "$terrain"
python3 "$root/deploy/client.py" watch "$url" "$flat"

# Two uploads that fail: what is no raster is found out by the build.
printf 'no raster' >"$work/bad.tif"
broken() { curl -sS -T "$work/bad.tif" -X POST "$url/v1/datasets?name=$1" | python3 -c 'import json, sys; print(json.load(sys.stdin)["id"])'; }
failed=$(broken bad.tif),$(broken worse.tif)
until [[ $(curl -fsS "$url/v1/datasets" | grep -c '"state": "failed"') -eq 2 ]]; do
  kill -0 "$server"
  sleep 0.1
done

curl -fsS -o "$work/manifest.json" "$url/v1/datasets/$terrain/manifest.json"
python3 "$here/known_heights.py" "$sample" "$work/manifest.json" >"$work/known.json"
cd "$modules"
node look.mjs --chromium "$chromium" --url "$url" --terrain "$terrain" --flat "$flat" --failed "$failed" --known "$work/known.json" \
  --raster "$sample" --bad "$work/bad.tif" --pictures "$pictures"
