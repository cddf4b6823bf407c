#!/usr/bin/env bash
# From a clone to tiles: installs what is missing, builds, starts the server, posts a DEM and shows what came out of it.
#
#   deploy/quickstart.sh [dem.tif] [--once] [--port N] [--OPTION VALUE]...
#
# Without a DEM the sample beside this script is taken. Other options are those of `cordillera post`:
# --error 2, --crs EPSG:2056, --vertical-datum ellipsoid, ... The data folder is the server's own: ./cordillera-data or $CORDILLERA_DATA.
# --once stops the server at the end; the exit code is 0 only if a tile that was fetched can be decoded.
# CORDILLERA_BUILD_FOLDER names a build folder that is used as it is instead of building in build/release.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(dirname "$here")

export no_proxy=127.0.0.1 NO_PROXY=127.0.0.1  # the server is this machine's, whatever stands between it and the world

say() { printf '\n== %s\n' "$*"; }
fail() { printf 'quickstart: %s\n' "$*" >&2; exit 1; }
usage() { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//;p}' "${BASH_SOURCE[0]}"; }

dem=
once=no
port=
options=()
while [[ $# -gt 0 ]]; do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --once) once=yes ;;
    --port) port=${2:?--port needs a number}; shift ;;
    --*=*) options+=("$1") ;;
    --dry-run) fail "--dry-run makes no tiles; ask the command line instead: cordillera build --dry-run dem.tif" ;;
    --*) [[ $# -ge 2 ]] || fail "$1 needs a value"; options+=("$1" "$2"); shift ;;
    *) [[ -z $dem ]] || fail "one DEM at a time: $dem or $1"; dem=$1 ;;
  esac
  shift
done
dem=${dem:-$here/sample/white_mountains_srtm3.tif}
[[ -f $dem ]] || fail "no such file: $dem"
[[ -z $port || $port =~ ^[0-9]+$ ]] || fail "--port $port: a number from 1 to 65535 is needed"

# --- build ---
build=${CORDILLERA_BUILD_FOLDER:-}
if [[ -z $build ]]; then
  say "Packages"
  "$here/install.sh" --web
  say "Build (build/release; the first time takes some minutes)"
  build=$root/build/release
  "$here/build.sh" cordillera
fi
build=$(cd "$build" 2>/dev/null && pwd) || fail "no such build folder: CORDILLERA_BUILD_FOLDER=$CORDILLERA_BUILD_FOLDER"
cordillera=$build/bin/cordillera
[[ -x $cordillera ]] || fail "no program at $cordillera"
if [[ ! -e $build/share/web/complete ]]; then
  printf 'The viewer was not built (npm or its registry is missing); everything else works.\n'
fi

# --- serve ---
port_is_busy() { (exec 3<>"/dev/tcp/127.0.0.1/$1") 2>/dev/null; }
if [[ -n $port ]]; then
  port_is_busy "$port" && fail "port $port is taken by another program; choose one with --port"
else
  port=8080
  while port_is_busy "$port"; do port=$((port + 1)); done
  [[ $port -eq 8080 ]] || printf 'Port 8080 is taken by another program: using %s instead.\n' "$port"
fi
url=http://127.0.0.1:$port
say "Server on $url"
work=$(mktemp -d)
"$cordillera" serve --listen "127.0.0.1:$port" --log-level info >"$work/server.log" 2>&1 &
server=$!
cleanup() {
  if kill -0 "$server" 2>/dev/null; then
    kill -TERM "$server"
    wait "$server" || true
  fi
  rm -rf "$work"
}
trap cleanup EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
for _ in $(seq 1 150); do
  curl -fsS -o "$work/ready" "$url/readyz" 2>/dev/null && break
  kill -0 "$server" 2>/dev/null || { cat "$work/server.log" >&2; fail "the server ended at once"; }
  sleep 0.2
done
curl -fsS -o "$work/ready" "$url/readyz" || { cat "$work/server.log" >&2; fail "the server did not become ready in 30 s"; }
data=$(sed -n 's/.*data in //p' "$work/server.log")
printf 'data in %s\n' "$data"

# --- post ---
say "POST $(basename "$dem") ($(stat -Lc %s "$dem") bytes)"
export CORDILLERA_SERVER=$url
"$cordillera" post "$dem" --json "${options[@]}" >"$work/posted.json" || { [[ ! -s $work/posted.json ]] || cat "$work/posted.json" >&2; fail "$dem was not taken"; }
id=$(sed -E 's/^\{"id":"([^"]*)".*/\1/' "$work/posted.json")
printf '%s/v1/datasets/%s\n' "$url" "$id"
"$cordillera" watch "$id" || fail "the build failed"

# --- report ---
say "Done"
"$cordillera" fetch "$id" manifest --quiet -o "$work/fetched/"
"$cordillera" info "$work/fetched"
drc=$("$cordillera" fetch "$id" --middle -o "$work/fetched/") || fail 'no tile of the finest level could be fetched'
dataset=$url/v1/datasets/$id
printf '\ncurl %s/tileset.json\ncurl -o tile.drc %s/%s\ncurl -o tile.glb %s/%s.glb\n' "$dataset" "$dataset" "$drc" "$dataset" "${drc%.drc}"
printf '\nLook at it: %s/?dataset=%s\n\n' "$url" "$id"
for tile in "$drc" "${drc%.drc}.glb"; do
  "$cordillera" fetch "$id" "${tile#tiles/}" --quiet -o "$work/fetched/" || fail "the tile $tile could not be fetched"
  printf 'decoded: '
  (cd "$work/fetched" && "$cordillera" decode "$tile") || fail "the tile $tile could not be decoded"
done
if [[ $once == yes ]]; then
  printf '\n--once: the server stops now; start it again with\n%s serve --listen 127.0.0.1:%s --data %s\n' "$cordillera" "$port" "$data"
  exit 0
fi
printf '\nThe server goes on; Ctrl-C stops it.\n'
wait "$server"
