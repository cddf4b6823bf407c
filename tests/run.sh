#!/usr/bin/env bash
# Installs what is missing, builds the release preset and runs the tests: C++, the quickstart as a user would run it, and the viewer
# in a headless browser (skipped, with the reason, where npm or Chromium is missing). Ends with ctest's own closing lines.
#   tests/run.sh            all but those of tests/long.txt, which take long and prove at size what others prove in small
#   tests/run.sh --all      those, too
#   tests/run.sh -R crash   arguments go to ctest, which then chooses among all
# CORDILLERA_CMAKE_ARGS adds configure options.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
left_out=() left_unbuilt=()
if [[ ${1:-} == --all ]]; then
  shift
  export CORDILLERA_ALL_TESTS=1
elif [[ $# -eq 0 ]]; then
  left_unbuilt=(-DCORDILLERA_LONG_TESTS=OFF -DCORDILLERA_BENCHES=OFF)
  left_out=(-E "^($(sed -e 's/#.*//' -e 's/[[:space:]]*$//' -e '/^$/d' tests/long.txt | paste -sd '|'))( .*)?$")  # of a test with a parameter ctest has its value, too
fi
deploy/install.sh --web
CORDILLERA_CMAKE_ARGS="-DCORDILLERA_LONG_TESTS=ON -DCORDILLERA_BENCHES=ON ${left_unbuilt[*]} ${CORDILLERA_CMAKE_ARGS:-}" deploy/build.sh
# Four more than there are processors: tests wait for a clock of the service, for a disk, or for a browser. With two more, one processor in six
# had nothing to do.
exec ctest --test-dir build/release -j"$(($(nproc) + 4))" --output-on-failure "${left_out[@]}" "$@"
