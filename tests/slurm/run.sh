#!/bin/bash
# A plan on a real Slurm of two nodes on this host: the result is that of a build in one process, byte for byte, whatever is killed
# meanwhile.
#
#   tests/slurm/run.sh BUILD [case...]     BUILD: where the program was built. Cases: plain task node controller storage twice bad
#
# Exit code 77: Slurm or munge is not installed (packages slurm-wlm, munge).
set -euo pipefail
build=$(realpath "${1:?usage: tests/slurm/run.sh BUILD [case...]}")
shift
cases=${*:-plain task node controller storage twice bad}
here=$(cd "$(dirname "$0")" && pwd)
program=$build/bin/cordillera
submit=$here/../../deploy/slurm/submit.sh
for need in slurmctld slurmd sbatch munged; do
  command -v $need > /dev/null || { echo "skipped: $need is not installed (slurm-wlm, munge)"; exit 77; }
done

. "$here/../processes.sh"
cluster=$work/cluster
# shellcheck source=tests/slurm/cluster.sh
. "$here/cluster.sh"
at_end stop_cluster
start_cluster || { echo "skipped: Slurm does not come up here"; exit 77; }

options=(--name cluster --max-level 13 --error 4 --vertical-datum ellipsoid)
python3 "$here/make_rasters.py" "$work/dem" 24
"$program" build "$work/dem" -o "$work/one" -q "${options[@]}"

failed() { echo "FAILED: $*" >&2; squeue >&2 || true; grep -h "^cordillera:" "$work"/*/log/*.log "$work"/*.log >&2 || true; exit 1; }
jobs_left() { squeue --noheader --format=%i 2> /dev/null || echo unknown; }
wait_for_jobs() {  # seconds
  for _ in $(seq $(($1 * 2))); do
    [ -n "$(jobs_left)" ] || return 0
    sleep 0.5
  done
  failed "jobs are left after $1 s"
}
submit_plan() {  # name, further words
  "$submit" "$work/$1" -o "$work/$1-out" --program "$program" --parts 12 --samples 1000000 --mem 500 "${@:2}"
}
plan_for() {  # name
  "$program" plan "$work/dem" -o "$work/$1" -q "${options[@]}"
  submit_plan "$1"
}
same_as_one() {  # name
  [ -d "$work/$1-out" ] || failed "$1: nothing was published"
  diff -r -x manifest.json "$work/one" "$work/$1-out" || failed "$1: other bytes than one process gives"
}
some_done() {  # name; waits until the first shards are there
  for _ in $(seq 960); do
    if [ "$(find "$work/$1/shards" -name '*.shard' 2> /dev/null | wc -l)" -ge 2 ]; then return 0; fi
    sleep 0.25
  done
  failed "$1: no task has ended"
}

blocks_of() { "$program" tasks "$work/$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)[0][sys.argv[1]])' "$2"; }  # name, tasks or done

status() {  # name, words
  "$here/../../deploy/slurm/status.sh" "$work/$1" --program "$program" > "$work/said"
  grep -q "$2" "$work/said" || failed "$1: status.sh does not say '$2': $(cat "$work/said")"
}

case_plain() {
  plan_for plain
  blocks=$(blocks_of plain tasks)
  [ "${blocks:-0}" -ge 20 ] || failed "only ${blocks:-no} blocks"
  ! submit_plan plain 2> "$work/said" || failed "a plan whose jobs are in the queue is queued again"
  grep -q 'the queue has jobs of this plan' "$work/said" || failed "$(cat "$work/said")"
  wait_for_jobs 240
  same_as_one plain
  status plain 'all is done, and was published'
  ! submit_plan plain 2> "$work/said" || failed "what was published is replaced without being asked for"
  grep -q 'is there already; --overwrite replaces it' "$work/said" || failed "$(cat "$work/said")"
  submit_plan plain --overwrite > "$work/said"  # nothing is left but to publish
  [ "$(grep -c 'tasks*, done$' "$work/said")" = "$(grep -c '^stage' "$work/said")" ] || failed "stages that are done are submitted: $(cat "$work/said")"
  wait_for_jobs 240
  same_as_one plain
}
case_task() {  # a task is killed in its middle, five times
  plan_for task
  some_done task
  last=
  for _ in 1 2 3 4 5; do
    until newest=$(pgrep -n -f "$program work $work/task") && [ "$newest" != "$last" ]; do  # the one that takes its place, or the end
      [ -n "$(jobs_left)" ] || break 2
      sleep 0.1
    done
    kill -KILL "$newest" || true
    last=$newest
  done
  wait_for_jobs 300
  same_as_one task
}
case_node() {  # a node's daemon and its tasks are killed; it comes back later
  plan_for node
  some_done node
  kill -KILL "$node1"
  stop "$node1" || true
  kill_ours slurmstepd cordillera
  start_node 1
  wait_for_jobs 300
  same_as_one node
}
# Jobs that may still run; not those that are held, or wait for what will never come.
jobs_alive() { squeue --noheader --format='%i %T %r' 2> /dev/null | grep -v -e DependencyNeverSatisfied -e [Hh]eld || true; }
case_controller() {  # it is killed while it has not yet written down what was submitted; what it forgot or holds is submitted again
  plan_for controller
  some_done controller
  kill -KILL "$controller"
  stop "$controller" || true
  start_controller
  until squeue --noheader > "$work/queue" 2>&1; do  # it answers again
    kill -0 "$controller" || failed "the controller does not start again"
    sleep 0.5
  done
  for _ in 1 2 3; do
    for _ in $(seq 600); do
      [ -n "$(jobs_alive)" ] || break
      sleep 0.5
    done
    [ ! -d "$work/controller-out" ] || break
    echo "tasks are left: submitted again"
    submit_plan controller --again --overwrite  # what was forgotten may publish meanwhile
  done
  same_as_one controller
}
case_storage() {  # the plan and the results of its tasks lie in a bucket; its server is killed in the middle, and comes back
  if ! (. "$here/../real_server.sh" "The case of the storage" && need_node && node_modules "$here/../storage" "$build/storage"); then
    echo "the case of the storage is left out"
    return
  fi
  # shellcheck source=tests/storage/storage.sh
  . "$here/../storage/storage.sh"
  node_modules() { :; }
  need_storage "$here/../storage" "$build"
  start_storage "$work/storage"
  (
    cd "$work"  # logs of a plan in a bucket go to where it is submitted
    "$program" plan "$work/dem" -o /vsis3/terrain/storage -q "${options[@]}"
    "$submit" /vsis3/terrain/storage -o "$work/storage-out" --program "$program" --parts 12 --samples 1000000 --mem 500
  )
  until [ "$(grep -c '^PUT 200 .*shard' "$storage_log")" -ge 2 ]; do
    [ -n "$(jobs_left)" ] || failed "storage: no task has ended"
    sleep 0.25
  done
  kill_storage
  until grep -q 'trying again' "$work"/stage-*.log 2> /dev/null; do  # a task has met the storage's end
    [ -n "$(jobs_left)" ] || failed "no task has met the storage's end"
    sleep 0.25
  done
  start_storage "$work/storage"
  wait_for_jobs 400
  same_as_one storage
  kill_storage
}
case_twice() {  # the same tasks by two at once
  "$program" plan "$work/dem" -o "$work/twice" -q "${options[@]}"
  start "$program" work "$work/twice" -q --threads 1
  first=$started
  "$program" work "$work/twice" -q --threads 1 --stage 0
  wait $first
  "$program" publish "$work/twice" -o "$work/twice-out" -q
  same_as_one twice
}
case_bad() {  # one raster cannot be read: its task says so, the others finish, and after the mending the same plan goes on
  python3 "$here/make_rasters.py" "$work/mended" 24
  python3 "$here/make_rasters.py" "$work/dem-bad" 24 broken
  "$program" plan "$work/dem-bad" -o "$work/bad" -q "${options[@]}"
  "$submit" "$work/bad" -o "$work/bad-out" --program "$program" --parts 24 --samples 1000 --mem 500
  wait_for_jobs 300
  [ ! -e "$work/bad-out" ] || failed "a plan with a failed task was published"
  grep -q dem23.tif "$work"/bad/log/*.log || failed "no log names the raster that cannot be read"
  status bad 'tasks are left: submit.sh'
  status bad 'stage-0-.*dem23.tif'
  undone=$(($(blocks_of bad tasks) - $(blocks_of bad done)))
  [ $undone -ge 1 ] && [ $undone -le 4 ] || failed "$undone blocks are undone; the broken raster touches no more than 4"
  # The raster is put right. It is another file now, so the plan is made anew; what does not depend on it is there already.
  cp "$work/mended/dem23.tif" "$work/dem-bad/dem23.tif"
  "$program" plan "$work/dem-bad" -o "$work/bad" -q "${options[@]}"
  "$submit" "$work/bad" -o "$work/bad-out" --program "$program" --parts 24 --samples 1000 --mem 500
  wait_for_jobs 300
  grep -q 'was there' "$work"/bad/log/stage-0-*.log || failed "everything was done again"
  same_as_one bad
  status bad 'all is done, and was published'
  ! grep dem23 "$work/said" || failed "status.sh tells what was mended"
}

for name in $cases; do
  echo "== $name"
  start=$(date +%s)
  "case_$name"
  echo "== $name: as in one process, $(($(date +%s) - start)) s"
done
