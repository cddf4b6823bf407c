#!/usr/bin/env bash
# Installs what is missing, builds the release preset and runs every test: C++, the quickstart as a user would run it, and the viewer
# in a headless browser (skipped, with the reason, where npm or Chromium is missing). Ends with ctest's own closing lines.
# Arguments go to ctest: tests/run.sh -R quickstart. CORDILLERA_CMAKE_ARGS adds configure options.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
deploy/install.sh --web
deploy/build.sh
# One more than there are processors: some tests wait for a clock of the service or for a disk.
exec ctest --test-dir build/release -j"$(($(nproc) + 1))" --output-on-failure "$@"
