#!/usr/bin/env bash
# Asks a server for its description and holds it against the schema of OpenAPI 3.1: tests/server/openapi_lint.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/openapi_lint.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The lint of the API'
need_node
modules=$build/openapi_lint
node_modules "$here/openapi_lint" "$modules"
cp "$here"/openapi_lint/check.mjs "$modules"

start_server "$build"
curl -fsS -o "$work/api.json" "$url/api"
node "$modules/check.mjs" "$work/api.json"
