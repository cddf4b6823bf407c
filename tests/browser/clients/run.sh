#!/usr/bin/env bash
# Runs the code of the client pages (server/docs) as it stands, in headless Chromium and Node.js:
#   tests/browser/clients/run.sh BUILD [PICTURES]
#   BUILD      a build folder with bin/cordillera
#   PICTURES   where the screenshots are left; BUILD/browser/clients by default
#   ONLY=NAME,NAME in the environment: only these clients
# Exits with 77, and says what is missing, where it cannot run.
# The shipped sample and, as a control that the test can fail, a flat raster in its place are posted to a server of its own.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../../.." && pwd)
chromium=$(command -v chromium || command -v chromium-browser || true)

export no_proxy=127.0.0.1 NO_PROXY=127.0.0.1
build=$(cd "${1:?usage: tests/browser/clients/run.sh BUILD [PICTURES]}" && pwd)
missing=()
[[ -n $chromium ]] || missing+=(Chromium)
command -v npm >/dev/null || missing+=(npm)
if [[ ${#missing[@]} -gt 0 ]]; then
  printf 'The client test is left out; missing: %s\n' "$(printf '%s, ' "${missing[@]}" | sed 's/, $//')"
  exit 77
fi
if ! node -e 'process.exit(Number(process.versions.node.split(".")[0]) >= 18 ? 0 : 1)'; then
  printf 'The client test is left out; missing: Node.js 18 or newer (this is %s)\n' "$(node --version)"
  exit 77
fi
pictures=${2:-$build/browser/clients}
mkdir -p "$pictures"
pictures=$(cd "$pictures" && pwd)
modules=$build/browser/clients-npm
work=$(mktemp -d)
server=
cleanup() {
  [[ -z $server ]] || { kill -TERM "$server" 2>/dev/null && wait "$server"; } || true
  rm -rf "$work"
}
trap cleanup EXIT

# npm works in a folder of its own, so that a checkout stays clean, and only when the lock file is not the one it worked for last.
mkdir -p "$modules/clients"
cp "$here/package.json" "$modules"
fetch() { (cd "$modules" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null); }
if ! cmp -s "$here/package-lock.json" "$modules/fetched-lock.json"; then
  cp "$here/package-lock.json" "$modules"
  if ! fetch && ! fetch; then
    (cd "$modules" && npm ping >/dev/null 2>&1) && exit 1  # the registry is there: what we ask of it is wrong
    printf 'The client test is left out; missing: the registry of npm\n'
    exit 77
  fi
  cp "$here/package-lock.json" "$modules/fetched-lock.json"
fi
cp "$here"/../browser.mjs "$modules"
cp -r "$here"/*.mjs "$here/drivers" "$modules/clients"

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
url=http://127.0.0.1:$port
"$build/bin/cordillera" serve --listen "127.0.0.1:$port" --data "$work/data" >"$work/server.log" 2>&1 &
server=$!
until curl -fs -o /dev/null "$url/readyz"; do
  kill -0 "$server" || { cat "$work/server.log" >&2; exit 1; }
  sleep 0.2
done

# The same place, size and pixels as the sample's, without its relief.
sample=$root/deploy/sample/white_mountains_srtm3.tif
gdal_create -q -of GTiff -ot Int16 -outsize 960 540 -bands 1 -burn 500 -a_srs EPSG:4326 -a_ullr -71.85 44.5 -71.05 44.05 "$work/flat.tif"
post() {
  curl -fsS -T "$1" -X POST -H 'Prefer: wait=300' "$url/v1/datasets?name=$(basename "$1")" |
    python3 -c 'import json, sys; print(json.load(sys.stdin)["id"])'
}
terrain=$(post "$sample")
flat=$(post "$work/flat.tif")
for id in "$terrain" "$flat"; do
  python3 "$root/deploy/client.py" watch "$url" "$id"
  mkdir -p "$work/archives/$id"
  "$build/bin/cordillera" export "$work/data/datasets/$id" -o "$work/archives/$id/dem.pmtiles" >/dev/null
  "$build/bin/cordillera" export "$work/data/datasets/$id" -o "$work/archives/$id/drc.pmtiles" --format drc >/dev/null
done

curl -fsS -o "$work/manifest.json" "$url/v1/datasets/$terrain/manifest.json"
python3 "$here/../known_heights.py" "$sample" "$work/manifest.json" >"$work/known.json"
cd "$modules/clients"
node look.mjs --chromium "$chromium" --url "$url" --terrain "$terrain" --flat "$flat" \
  --known "$work/known.json" --archives "$work/archives" \
  --docs "$root/server/docs" --readme "$root/README.md" --modules "$modules/node_modules" \
  --pictures "$pictures" ${ONLY:+--only "$ONLY"}
