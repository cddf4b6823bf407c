#!/usr/bin/env bash
# The tests under a sanitizer:  tests/sanitize.sh address|thread [ctest arguments]
# Builds the preset host-asan (address and undefined behaviour) or host-tsan and runs ctest there. A test program is one test: -R '^server_test'.
# Left out is what starts other people's programs, what compares bytes of two compilers, and what reads the sources. A report of a sanitizer fails
# its test; in a server or a job it stands in the test's output. Prints the commit at the end, for the table in README.md.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
case ${1:-} in
  address) preset=host-asan ;;
  thread) preset=host-tsan ;;
  *) echo "sanitize.sh address|thread [ctest arguments]"; exit 1 ;;
esac
shift
# A raster that lies about its size makes GDAL ask for more than there is: no memory is an answer.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_stack_use_after_return=1:strict_string_checks=1:check_initialization_order=1:allocator_may_return_null=1:max_allocation_size_mb=4000}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}
export LSAN_OPTIONS=${LSAN_OPTIONS:-suppressions=$root/tests/sanitize/leaks.txt:print_suppressions=0}
export TSAN_OPTIONS=${TSAN_OPTIONS:-suppressions=$root/tests/sanitize/threads.txt:second_deadlock_stack=1:allocator_may_return_null=1:max_allocation_size_mb=4000}
# A program of the build is run by it, so the options stand before.
cmake --preset $preset -S "$root" >/dev/null
cmake --build "$root/build/$preset" -j "${JOBS:-$(nproc)}"
status=0
ctest --test-dir "$root/build/$preset" -j "${JOBS:-$(nproc)}" --output-on-failure -E '^(browser|validators|slurm|deploy|same_bits|crash|tree)\.?' "$@" || status=$?
echo "$preset, $(date -u '+%Y-%m-%d %H:%M') UTC, $(git -C "$root" describe --always --dirty 2>/dev/null || echo 'no commit')"
exit $status
