#!/bin/sh
# How far a plan is: shards that are there, jobs that Slurm still has, and what failed tasks said last.
#
#   deploy/slurm/status.sh PLAN [--program FILE]
set -eu
plan=${1:?which plan? status.sh PLAN}
program=cordillera
if [ "${2:-}" = --program ]; then program=${3:?--program needs a file}; fi
"$program" tasks "$plan"
squeue --noheader --format='%i %j %T %r' 2>/dev/null | grep cordillera- || echo "no job in the queue; if tasks are left: submit.sh PLAN --again, with the same words as before"
for log in "$plan"/log/*.log; do
  [ -e "$log" ] || continue
  last=$(grep '^cordillera: ' "$log" | tail -n 1 || true)
  if [ -n "$last" ]; then echo "$(basename "$log"): $last"; fi
done
