# Sourced after processes.sh: a real Slurm of two nodes on this host's loopback, in the folder $cluster. start_cluster, stop_cluster, start_node N,
# start_controller. Everything runs as who calls.
: "${cluster:?}"

free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# common_conf PORT: what slurm.conf says of any cluster that lives on one host, in $cluster, with a controller at PORT.
common_conf() {
  cat <<EOF
ClusterName=loopback
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=$1
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/munge
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool/%n
SlurmdPidFile=$cluster/%n.pid
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdLogFile=$cluster/%n.log
SlurmctldLogFile=$cluster/slurmctld.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
EOF
}

start_controller() {
  start slurmctld -f "$cluster/slurm.conf" -D >> "$cluster/slurmctld.out" 2>&1
  controller=$started
}
start_node() {  # 1 or 2
  start slurmd -f "$cluster/slurm.conf" -N "n$1" -D >> "$cluster/n$1.out" 2>&1
  eval "node$1=$started"
}

start_cluster() {
  mkdir -p "$cluster/state" "$cluster/spool"
  chmod 700 "$cluster"
  head -c 64 /dev/urandom > "$cluster/munge.key"
  chmod 400 "$cluster/munge.key"
  start munged --force --foreground --socket="$cluster/munge.socket" --key-file="$cluster/munge.key" --pid-file="$cluster/munged.pid" \
    --log-file="$cluster/munged.log" --seed-file="$cluster/munge.seed" >> "$cluster/munged.out" 2>&1
  host=$(hostname -s)
  { common_conf "$(free_port)"; cat <<EOF; } > "$cluster/slurm.conf"
AuthInfo=socket=$cluster/munge.socket,cred_expire=20
JobRequeue=1
SlurmdTimeout=20
SlurmctldTimeout=20
MinJobAge=600
SchedulerParameters=sched_interval=2,batch_sched_delay=1,sched_min_interval=500000
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(free_port) CPUs=1 RealMemory=4000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$(free_port) CPUs=1 RealMemory=4000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
EOF
  export SLURM_CONF=$cluster/slurm.conf
  start_controller
  start_node 1
  start_node 2
  for _ in $(seq 480); do
    if [ "$(sinfo --noheader --format=%T 2>/dev/null | sort -u)" = idle ]; then return 0; fi
    sleep 0.5
  done
  echo "the cluster does not come up:" >&2
  sinfo >&2 || true
  tail -n 20 "$cluster"/*.out "$cluster"/*.log >&2 || true
  return 1
}

# kill_ours NAME...: what the daemons of this cluster have started, and no other's: slurmstepd leaves its parent, so they are known by what
# their environment says.
kill_ours() {
  local name process
  for name in "$@"; do
    for process in $(pgrep -x "$name" || true); do
      ! tr '\0' '\n' 2>/dev/null < "/proc/$process/environ" | grep -qF "$cluster" || kill -KILL "$process" 2>/dev/null || true
    done
  done
}

stop_cluster() {
  for process in "${node1:-}" "${node2:-}" "${controller:-}"; do [ -z "$process" ] || stop "$process" || true; done
  kill_ours slurmstepd cordillera slurm_script
}
