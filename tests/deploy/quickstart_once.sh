#!/usr/bin/env bash
# quickstart --once with the shipped sample, on a build that is there: quickstart_once.sh BUILD. quickstart fetches and decodes tiles
# itself; its words, the promise of --error and the end of its server are checked here.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
expect() { grep -qE "$1" "$work/words" || { printf 'quickstart did not print: %s\n' "$1" >&2; exit 1; }; }

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
CORDILLERA_BUILD_FOLDER=$1 CORDILLERA_DATA=$work/data "$root/deploy/quickstart.sh" --once --port "$port" --error 4 2>&1 | tee "$work/words"

expect '^level +tiles +triangles'
expect '^ +0 +1 '
expect "^curl http://127.0.0.1:$port/v1/datasets/[a-z0-9-]+/tileset.json$"
expect '^curl -o tile.drc .*/tiles/[0-9]+/[0-9]+/[0-9]+\.drc$'
expect '^curl -o tile.glb .*/tiles/[0-9]+/[0-9]+/[0-9]+\.glb$'
[[ $(grep -c '^decoded: ' "$work/words") -eq 2 ]] || { printf 'two tiles should have been decoded\n' >&2; exit 1; }
# The finest level keeps the promise of --error 4, in the table too.
python3 - "$work/words" <<'PY'
import re, sys
rows = [line.split() for line in open(sys.argv[1], encoding="utf-8") if re.match(r"^ +\d+ +\d+ +\d+ +\d+ [kMG]?B ", line)]
finest = max(rows, key=lambda row: int(row[0]))
error = float(finest[6].rstrip("*"))  # after level, tiles, triangles, a size with its unit, target
if not 0 < error <= 4:
    sys.exit(f"--error 4, but the finest level states {error}")
PY
if (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then
  printf 'the server of --once is still there\n' >&2
  exit 1
fi
