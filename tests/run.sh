#!/usr/bin/env bash
# Installs what is missing, builds the release preset, runs every test:
#   1. the C++ tests (ctest);  2. deploy/quickstart.sh --once as a user would run it;  3. the viewer in a headless browser.
# The browser part is left out, and said to be, where Chromium or npm is missing. CORDILLERA_CMAKE_ARGS adds configure options.
# Two at a time on purpose: tests of peak memory share the machine with each other otherwise.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root" || exit 1

passed=0
failed=0
started=$SECONDS
part() {
  local name=$1
  shift
  printf '\n== %s\n' "$name"
  if "$@"; then
    passed=$((passed + 1))
  else
    failed=$((failed + 1))
    printf '== FAILED: %s\n' "$name"
  fi
}
summary() {
  printf '\n%d parts passed, %d failed, %d s\n' "$passed" "$failed" "$((SECONDS - started))"
  # The last line is the count of the C++ tests and of the parts beside them.
  local line
  line=$(grep -E 'tests passed, [0-9]+ tests failed' "$log" 2>/dev/null | tail -n 1)
  local all bad
  all=$(sed -nE 's/.* out of ([0-9]+)$/\1/p' <<<"$line")
  bad=$(sed -nE 's/.*passed, ([0-9]+) tests failed.*/\1/p' <<<"$line")
  all=${all:-0} bad=${bad:-0}
  # ctest itself is one of the parts: its tests are counted instead of it.
  local beside_failed=$((failed - (bad > 0 ? 1 : 0))) beside_passed=$((passed - (all > 0 && bad == 0 ? 1 : 0)))
  printf '%d passed, %d failed\n' "$((all - bad + beside_passed))" "$((bad + beside_failed))"
  [[ $failed -eq 0 ]]
}
log=$(mktemp)
data=$(mktemp -d)
trap 'rm -rf "$log" "$data"' EXIT

ctest_all() { ctest --test-dir build/release -j2 --output-on-failure 2>&1 | tee "$log"; }
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
quickstart() { CORDILLERA_BUILD=$root/build/release CORDILLERA_DATA=$data deploy/quickstart.sh --once --port "$(free_port)"; }

printf '== Packages\n'
deploy/install.sh --web || exit 1
printf '\n== Build\n'
deploy/build.sh || { printf '0 passed, 1 failed\n'; exit 1; }
part "C++ tests" ctest_all
part "Quickstart with the sample" quickstart
if tests/browser/run.sh --can-run; then
  part "Viewer in a headless browser" tests/browser/run.sh build/release
fi
summary
