#!/usr/bin/env bash
# What quickstart cannot do, it says in one line that names the cause: quickstart_refuses.sh BUILD
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
. "$root/tests/processes.sh"

# refuses WORDS ARGUMENT...: a failure whose message holds the words.
refuses() {
  local words=$1
  shift
  if CORDILLERA_BUILD_FOLDER=$build CORDILLERA_DATA=$work/data "$root/deploy/quickstart.sh" --once "$@" >"$work/out" 2>&1; then
    printf 'accepted: %s\n' "$*" >&2
    exit 1
  fi
  grep -qF -- "$words" "$work/out" || { printf 'for "%s" it said:\n' "$*" >&2; cat "$work/out" >&2; exit 1; }
}

build=$1
refuses "no such file: nowhere.tif" nowhere.tif
refuses "one DEM at a time" "$0" "$0"
refuses "--port abc" --port abc
refuses "--error needs a value" --error

start python3 -c 'import signal, socket
s = socket.socket(); s.bind(("127.0.0.1", 0)); s.listen(); print(s.getsockname()[1], flush=True); signal.pause()' >"$work/port"
listener=$started
while [[ ! -s $work/port ]]; do
  kill -0 "$listener" || { printf 'nothing listens to take a port\n' >&2; exit 1; }
  sleep 0.1
done
refuses "port $(cat "$work/port") is taken" --port "$(cat "$work/port")"

build=$work/nowhere
refuses "no such build folder"
build=$work
mkdir "$work/bin"
refuses "no program at"
