# For tests that talk to a real server, many of them by programs of Node.js: sourced after `set -euo pipefail`, with the test's name, as
# it says that something is missing: . tests/real_server.sh "The browser test"
# Gives what processes.sh gives, and the functions below. A server that was started is stopped at the end.
test_name=${1:?the test\'s name}
repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export no_proxy=127.0.0.1 NO_PROXY=127.0.0.1
. "$repository/tests/processes.sh"
server_pid=

# Ends the test as skipped: ctest is told that 77 means so.
leave_out() {
  printf '%s is left out; missing: %s\n' "$test_name" "$*"
  exit 77
}

need_node() {
  local program
  for program in npm node curl "$@"; do
    command -v "$program" >/dev/null || leave_out "$program"
  done
  node -e 'process.exit(Number(process.versions.node.split(".")[0]) >= 18 ? 0 : 1)' ||
    leave_out "Node.js 18 or newer (this is $(node --version))"
}

need_chromium() {
  chromium=$(command -v chromium || command -v chromium-browser) || leave_out Chromium
  "$chromium" --version >/dev/null 2>&1 || leave_out "Chromium ($chromium does not run: Ubuntu's package is a script that asks for a snap)"
}

# node_modules SOURCE FOLDER: puts what SOURCE/package-lock.json names into FOLDER/node_modules. It is fetched once for each lock file,
# into a cache outside of the checkout and of the build; FOLDER has a link to it.
node_modules() {
  local source=$1 folder=$2 cache
  cache=${CORDILLERA_CACHE:-${XDG_CACHE_HOME:-${HOME:-$folder}/.cache}/cordillera}/npm/$(sha256sum "$source/package-lock.json" | cut -c1-16)
  mkdir -p "$cache" "$folder"
  exec 9>"$cache/lock"
  flock 9
  if [[ ! -e $cache/complete ]]; then
    cp "$source/package.json" "$source/package-lock.json" "$cache"
    npm_ci "$cache" || npm_ci "$cache" || {
      (cd "$cache" && npm ping >/dev/null 2>&1) && exit 1  # the registry is there: what we ask of it is wrong
      leave_out 'the registry of npm'
    }
    touch "$cache/complete"
  fi
  exec 9>&-
  [[ -L $folder/node_modules ]] || rm -rf "$folder/node_modules"
  ln -sfn "$cache/node_modules" "$folder/node_modules"
}
npm_ci() { (cd "$1" && npm ci --prefer-offline --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null); }

# start_server BUILD [OPTION]...: sets $url, for cordillera's own commands too, and $cordillera; what it keeps is in $server_data, or
# in $work/data where that is not set.
start_server() {
  local build=$1 port
  shift
  port=$(free_port)
  url=http://127.0.0.1:$port
  export CORDILLERA_SERVER=$url
  cordillera=$build/bin/cordillera
  start "$cordillera" serve --listen "127.0.0.1:$port" --data "${server_data:-$work/data}" "$@" >"$work/server.log" 2>&1
  server_pid=$started
  until_ready "$server_pid" "$work/server.log"
}

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# until_ready PROCESS LOG: the service at $url is; fails with its log if it ends before.
until_ready() {
  until curl -fs -o /dev/null "$url/readyz"; do
    kill -0 "$1" || { cat "$2" >&2; exit 1; }
    sleep 0.1
  done
}

# post RASTER: prints the id of the dataset, as soon as it is ready; fails if it never is.
post() { "$cordillera" post "$1" --wait --quiet --json | json_id; }
json_id() { python3 -c 'import json, sys; print(json.load(sys.stdin)["id"])'; }
