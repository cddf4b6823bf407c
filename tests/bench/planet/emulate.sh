#!/bin/bash
# A plan on clusters that are not there: one real Slurm controller, a slurmd of its own for each node, all on this machine; submit.sh submits the
# plan, and each task sleeps for as long as measured tasks take.
#
#   tests/bench/planet/emulate.sh PLAN TIMES.json NODES... [options]       NODES: how many, e.g. 16 64 256; TIMES.json: see measure.py
#
#   --cores N        of a node [4]; tasks that run at once take some 3 MB of memory each
#   --seconds N      that the blocks should take on the clock: all times are divided by what that takes [200]
#   --parts N        of an array, as for submit.sh [1000]
#   --scheduler W    SchedulerParameters of slurm.conf
#   --program FILE   cordillera [found in PATH]
#
# Needs slurm-wlm and munge. Debian's slurm-wlm-emulator is not used: its programs want a library that was built for front-end nodes, and
# load Debian's other one, which refuses them.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
fail() { echo "emulate.sh: $*" >&2; exit 2; }
words=() cores=4 seconds=200 parts=1000 program= scheduler=
while (($#)); do
  case $1 in
    --cores|--seconds|--parts|--program|--scheduler) (($# >= 2)) || fail "$1 needs a value"; declare "${1#--}=$2"; shift 2 ;;
    -*) fail "unknown option $1" ;;
    *) words+=("$1"); shift ;;
  esac
done
((${#words[@]} >= 3)) || fail "PLAN, TIMES.json and at least one number of nodes"
plan=$(realpath "${words[0]}") times=$(realpath "${words[1]}")
program=${program:-$(command -v cordillera)} || fail "cordillera is not in PATH; say --program"
for need in slurmctld slurmd sbatch munged; do command -v $need > /dev/null || fail "$need is not installed (slurm-wlm, munge)"; done

work=$(mktemp -d)
chmod 700 "$work"
daemons=()
stop() {
  if ((${#daemons[@]})); then
    scancel --me 2> /dev/null || true
    sleep 2
    kill "${daemons[@]}" 2> /dev/null || true
    wait "${daemons[@]}" 2> /dev/null || true
  fi
  daemons=()
}
trap 'stop; rm -rf "$work" 2> /dev/null || { sleep 3; rm -rf "$work"; }' EXIT

free_ports() {  # how many, one after the other
  python3 - "$1" << 'END'
import random, socket, sys
count = int(sys.argv[1])
while True:
    first, taken = random.randrange(20000, 60000 - count), []
    try:
        for port in range(first, first + count):
            taken.append(socket.socket())
            taken[-1].bind(("127.0.0.1", port))
    except OSError:
        continue
    print(first)
    break
END
}

cluster=$work  # of each run: start_cluster
. "$here/../../slurm/cluster.sh"
start_cluster() {  # nodes
  cluster=$work/$1
  mkdir -p "$cluster/state" "$cluster/spool" "$cluster/plan/log"
  ln -s "$plan/plan.json" "$cluster/plan/plan.json"
  head -c 64 /dev/urandom > "$cluster/munge.key"
  chmod 400 "$cluster/munge.key"
  munged --force --foreground --socket="$cluster/munge.socket" --key-file="$cluster/munge.key" --pid-file="$cluster/munged.pid" \
    --log-file="$cluster/munged.log" --seed-file="$cluster/munge.seed" --num-threads=8 >> "$cluster/munged.out" 2>&1 &
  daemons+=($!)
  local host first
  host=$(hostname -s) first=$(free_ports $(($1 + 1)))
  { common_conf "$first"; cat << END; } > "$cluster/slurm.conf"
AuthInfo=socket=$cluster/munge.socket
SlurmdTimeout=180
MessageTimeout=60
MaxArraySize=$((parts + 1))
MaxJobCount=$((parts * 20 + 10000))
${scheduler:+SchedulerParameters=$scheduler}
NodeName=n[1-$1] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((first + 1))-$((first + $1))] CPUs=$cores RealMemory=$((cores * 2048))
PartitionName=all Nodes=n[1-$1] Default=YES MaxTime=INFINITE State=UP
END
  export SLURM_CONF=$cluster/slurm.conf
  slurmctld -f "$SLURM_CONF" -D >> "$cluster/slurmctld.out" 2>&1 &
  daemons+=($!)
  for k in $(seq "$1"); do
    slurmd -f "$SLURM_CONF" -N "n$k" -D >> "$cluster/slurmd.out" 2>&1 &
    daemons+=($!)
    ((k % 4)) || sleep 0.5  # all at once, some would not get through to the controller
  done
  for _ in $(seq 600); do
    if [[ $(sinfo --noheader --format=%D.%T 2> /dev/null) == "$1.idle" ]]; then return; fi
    sleep 0.5
  done
  sinfo >&2 || true
  tail -n 5 "$cluster"/*.out "$cluster/slurmctld.log" >&2 || true
  fail "the cluster of $1 nodes does not come up"
}

# In place of cordillera: the same words, and a sleep.
make_sleeper() {
  cat > "$cluster/cordillera" << END
#!/bin/bash
begin=\$EPOCHREALTIME
case \$1 in
  tasks) exec cat "$work/tasks.json" ;;
  work)
    mapfile -t -s "\${6%/*}" -n 1 pause < "$cluster/stage-\$4-of-\${6#*/}"
    sleep "\${pause[0]:?no such part}"
    echo "\$4 \${6%/*} \$begin \$EPOCHREALTIME \${pause[0]}" >> "$cluster/ran" ;;
  publish) echo "publish 0 \$begin \$begin 0" >> "$cluster/ran" ;;
esac
END
  chmod +x "$cluster/cordillera"
}

"$program" tasks "$plan" --json > "$work/tasks.json"
mkdir "$work/sleeps"
"$here/schedule.py" "$plan" --times "$times" --parts "$parts" --sleeps "$work/sleeps"
for nodes in "${words[@]:2}"; do
  start_cluster "$nodes"
  make_sleeper
  scale=$(awk -v slots=$((nodes * cores)) -v seconds="$seconds" '{ sum += $1 } END { print sum / slots / seconds }' "$work"/sleeps/stage-0-of-*)
  for file in "$work"/sleeps/*; do awk -v scale="$scale" '{ printf "%.3f\n", $1 / scale }' "$file" > "$cluster/${file##*/}"; done
  began=$EPOCHREALTIME idle=0
  "$here/../../../deploy/slurm/submit.sh" "$cluster/plan" -o "$cluster/out" --parts "$parts" --program "$cluster/cordillera" > "$cluster/submitted"
  submitted=$EPOCHREALTIME
  while ! grep -qs '^publish' "$cluster/ran"; do
    if [[ -z $(squeue --noheader --format=%i 2> /dev/null || echo unknown) ]] && ((++idle > 10)); then break; fi  # the last job may still write
    sleep 0.5
  done
  grep -qs '^publish' "$cluster/ran" || { tail "$cluster"/plan/log/*.log >&2; fail "jobs ended before publish"; }
  "$here/emulated.py" "$cluster/ran" --nodes "$nodes" --cores "$cores" --scale "$scale" --began "$began" --submitted "$submitted"
  stop
done
