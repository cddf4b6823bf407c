#!/bin/sh
# How far a plan is: shards that are there, jobs that Slurm still has, and what tasks that failed said last. What was said before the last
# submit.sh, before a task began again, or in a stage that is done by now is left out.
#
#   deploy/slurm/status.sh PLAN [--program FILE]
set -eu
plan=${1:?which plan? status.sh PLAN}
program=cordillera
if [ "${2:-}" = --program ]; then program=${3:?--program needs a file}; fi
"$program" tasks "$plan"
stages=$("$program" tasks "$plan" --json | tr -d ' \n[]' | tr '}' '\n' | sed -n 's/.*"stage":\([0-9]*\),"tasks":\([0-9]*\),"done":\([0-9]*\),.*/\1 \2 \3/p')
done=$(echo "$stages" | awk '$2 == $3 { print $1 }')
left=$(echo "$stages" | awk '$2 != $3 { print $1 }')
case $plan in /vsi*) mark="cordillera ${plan%/}" ;; *) mark="cordillera $(realpath "$plan")" ;; esac  # as in submit.sh
queue=$(squeue --noheader --format='%i %j %T %r|%k' 2> /dev/null | awk -F'|' -v mark="$mark" '$2 == mark { print $1 }')
# The last words of the last time that it began.
last() { awk '/^submit.sh: begins/ { said = "" } /^cordillera: warning:/ { next } /^(cordillera|slurmstepd): / { said = $0 } END { if (said) print said }' "$1"; }
if [ -n "$queue" ]; then
  echo "$queue"
elif [ -n "$left" ]; then
  echo "no job in the queue, and tasks are left: submit.sh PLAN, with the same words as before"
elif tail -n 1 "$plan/log/publish.log" 2> /dev/null | grep -q '^submit.sh: ended with 0$'; then
  echo "no job in the queue; all is done, and was published"
else
  echo "no job in the queue, and all tasks are done: submit.sh PLAN publishes, with the same words as before"
fi
for log in "$plan"/log/*.log; do
  [ -e "$log" ] || continue
  stage=$(basename "$log" | sed -n 's/^stage-\([0-9]*\)-.*/\1/p')
  if [ -n "$stage" ] && echo "$done" | grep -qx "$stage"; then continue; fi
  if [ -e "$plan/log/submitted" ] && [ -z "$(find "$log" -newer "$plan/log/submitted")" ]; then continue; fi
  said=$(last "$log")
  if [ -n "$said" ]; then echo "$(basename "$log"): $said"; fi
done
