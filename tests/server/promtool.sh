#!/usr/bin/env bash
# What a server that built something, answered and refused says at /metrics, judged by Prometheus' own promtool: tests/server/promtool.sh BUILD
# Exits with 77, and says what is missing, where it cannot run: promtool is in Debian's package prometheus, which is too large to be asked for.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/server/promtool.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The check of the metrics'
command -v promtool > /dev/null || leave_out promtool
# A judge that accepts everything is none.
! printf 'a_total{b="c"} 1\na_total{b="c"} 2\n' | promtool check metrics > /dev/null 2>&1 || { echo 'promtool takes a number twice' >&2; exit 1; }

start_server "$build"
id=$("$cordillera" post "$repository/deploy/sample/white_mountains_srtm3.tif" --error 200 --wait --quiet --json | json_id)
curl -fsS -o "$work/answer" "$url/v1/datasets/$id/tileset.json"
curl -sS -o "$work/answer" "$url/v1/datasets/none"
curl -sS -o "$work/answer" "$url/v1/datasets/$id?bad=1"
curl -fsS -o "$work/metrics" "$url/metrics"
[[ $(grep -c '^# TYPE ' "$work/metrics") -ge 30 ]] || { echo "only $(grep -c '^# TYPE ' "$work/metrics") metrics" >&2; exit 1; }
promtool check metrics < "$work/metrics"
