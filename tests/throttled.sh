#!/usr/bin/env bash
# Tests on a quarter of the processor:  tests/throttled.sh BUILD [ctest arguments]
# What waits for a time and not for what is meant fails here. By default the tests with waits: browsers, attacks, crashes, soak, live builds, the client, floods of the front.
# SHARE=8 gives them an eighth of all processors. Needs root and the cpu controller of control groups (v1 or v2); without, it says so and exits with 77.
set -euo pipefail
build=${1:?throttled.sh BUILD [ctest arguments]}
shift
[[ $# -gt 0 ]] || set -- -R '^(attack|browser|crash|examples|soak|storage)\.|^(Live[A-Za-z]*|Operator|Updates)\.|^(access|client|program|sent_post|server|unsent|want)_test$'
period_us=100000
quota_us=$((period_us * $(nproc) / ${SHARE:-4}))
name=cordillera-throttled-$$
if [[ -f /sys/fs/cgroup/cpu/cpu.cfs_quota_us || -f /sys/fs/cgroup/cpu/cpu.shares ]]; then
  group=/sys/fs/cgroup/cpu/$name
  limit() { echo $period_us >"$group/cpu.cfs_period_us" && echo $quota_us >"$group/cpu.cfs_quota_us"; }
else
  group=/sys/fs/cgroup/$name
  limit() { echo "$quota_us $period_us" >"$group/cpu.max"; }
  echo +cpu >/sys/fs/cgroup/cgroup.subtree_control 2>/dev/null || true
fi
if ! mkdir "$group" 2>/dev/null; then
  echo "throttled: no control group can be made here (root, and /sys/fs/cgroup writable)"
  exit 77
fi
# Tests end what they start, and a group that is empty can go.
trap 'rmdir "$group" 2>/dev/null || echo "throttled: something of the tests still runs: $(tr "\n" " " <"$group/cgroup.procs")"' EXIT
if ! limit 2>/dev/null; then
  echo "throttled: this system's control groups do not limit the processor"
  exit 77
fi
echo "throttled: $((quota_us / 1000)) of $((period_us * $(nproc) / 1000)) ms of processor, $(git -C "$build" describe --always --dirty 2>/dev/null || echo 'no commit')"
status=0
# The shell that becomes ctest joins the group, not this one, which removes it.
bash -c 'echo $$ >"$1/cgroup.procs" && shift && exec "$@"' throttled "$group" ctest --test-dir "$build" -j 1 --output-on-failure "$@" || status=$?
grep -h nr_throttled "$group/cpu.stat" || true
exit $status
