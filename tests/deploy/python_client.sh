#!/usr/bin/env bash
# The Python client against a real server, also through a proxy that breaks connections, and against one that says what a test wants; its
# wheel; its types, where mypy is:
#   python_client.sh BUILD
set -euo pipefail
build=$(cd "${1:?usage: tests/deploy/python_client.sh BUILD}" && pwd)
. "$(dirname "${BASH_SOURCE[0]}")/../real_server.sh" "The test of the Python client"
client=$repository/deploy/python
command -v gdal_translate >/dev/null || leave_out gdal_translate
fail() { printf 'python_client: %s\n' "$*" >&2; exit 1; }

mkdir "$work/one" "$work/two"
export SOURCE_DATE_EPOCH=1700000000
wheel=$("$client/make_wheel.py" "$work/one")
"$client/make_wheel.py" "$work/two" >/dev/null
cmp "$work/one/$wheel" "$work/two/$wheel" || fail "two wheels of one source differ"
python3 -m zipfile -l "$work/one/$wheel" | grep 'cordillera/py.typed' >/dev/null || fail "the wheel says nothing of its types"
grep -q "\"$(sed -n 's/^project(cordillera VERSION \([0-9.]*\).*/\1/p' "$repository/CMakeLists.txt")\"" "$client/pyproject.toml" || fail "the client has another version"
! command -v mypy >/dev/null || mypy --cache-dir "$work/mypy" --config-file "$client/pyproject.toml" --strict "$client/cordillera" >"$work/types" || fail "$(<"$work/types")"

export XDG_STATE_HOME=$work/state PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$work/one/$wheel
python3 "$repository/tests/deploy/python_patience.py"

sample=$repository/deploy/sample/white_mountains_srtm3.tif
gdal_translate -q -outsize 2600 1800 -r bilinear "$sample" "$work/fine.tif"
start_server "$build"
python3 "$repository/tests/deploy/python_client.py" "$sample" "$work/fine.tif"
