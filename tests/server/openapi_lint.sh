#!/usr/bin/env bash
# Asks a server for its description and holds it against the schema of OpenAPI 3.1: tests/server/openapi_lint.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/openapi_lint.sh BUILD}" && pwd)
export no_proxy=127.0.0.1 NO_PROXY=127.0.0.1
for program in npm node curl; do
  command -v "$program" >/dev/null || { printf 'The lint of the API is left out; missing: %s\n' "$program"; exit 77; }
done

# npm works in a folder of its own, so that a checkout stays clean.
modules=$build/openapi_lint
mkdir -p "$modules"
cp "$here"/openapi_lint/* "$modules"
fetch() { (cd "$modules" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null); }
if ! fetch && ! fetch; then
  (cd "$modules" && npm ping >/dev/null 2>&1) && exit 1  # the registry is there: what we ask of it is wrong
  printf 'The lint of the API is left out; missing: the registry of npm\n'
  exit 77
fi

work=$(mktemp -d)
server=
cleanup() {
  [[ -z $server ]] || { kill -TERM "$server" 2>/dev/null && wait "$server"; } || true
  rm -rf "$work"
}
trap cleanup EXIT
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
"$build/bin/cordillera" serve --listen "127.0.0.1:$port" --data "$work/data" >"$work/server.log" 2>&1 &
server=$!
until curl -fs -o /dev/null "http://127.0.0.1:$port/readyz"; do
  kill -0 "$server" || { cat "$work/server.log" >&2; exit 1; }
  sleep 0.2
done
curl -fsS -o "$work/api.json" "http://127.0.0.1:$port/api"
cd "$modules"
node check.mjs "$work/api.json"
