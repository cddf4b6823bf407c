#!/bin/sh
# Hands a plan to Slurm: an array a stage, each stage after the one below it, then publish.
#
#   deploy/slurm/submit.sh PLAN -o OUTPUT [options]
#
#   -o OUTPUT         what publish writes: a folder, or a file called *.sqlite
#   --parts N         most tasks of an array [1000; a cluster's own limit is MaxArraySize - 1]
#   --samples N       finest samples that an array task should get at least [40000000, about a minute of a core]
#   --cpus N          cores of a task [1]
#   --mem MIB         memory of a task [1024, and 512 for each further core]; a stage that takes more gets more (cordillera tasks --json)
#   --time MINUTES    time limit of an array task [from its samples, at 100,000 a second, at least 10]
#   --gpu             a GPU for each task of stage 0 (--gres=gpu:1, --device cuda)
#   --retries N       how often a task is put back into the queue when it says that trying again may help [5]
#   --program FILE    cordillera [found in PATH]
#   --formats NAMES   of publish
#   --overwrite       publish replaces what is in the output's place; without it that is refused
#   --sbatch "WORDS"  further words for every sbatch: partition, account, ...
#   --again           first take back what the queue still has of this plan: after a controller that forgot jobs, or for held ones
#   --dry-run         say what would be submitted
#
# A task that fails for good leaves the others alone: they finish, the stages above are cancelled. Mend what it complains of and submit
# the same plan again: what is done is not done twice. The log of each task is in PLAN/log; of a plan in object storage, in this folder.
#
# A stage that is done is left out. A damaged shard that a task or publish finds is removed, and so done again with the next submission. A plan whose jobs are still in the queue is refused; --again takes them back first.
#
# A controller that is killed may forget what was submitted in the seconds before, and hold what it finds half started. status.sh shows
# tasks that are left without a job; the same line with --again gets them done.
set -eu

fail() { echo "submit.sh: $*" >&2; exit 2; }
plan= output= parts=1000 samples=40000000 cpus=1 mem= minutes= gpu= retries=5 program= formats= extra= dry= again= overwrite=
while [ $# -gt 0 ]; do
  case $1 in
    --gpu) gpu=yes; shift; continue ;;
    --dry-run) dry=yes; shift; continue ;;
    --again) again=yes; shift; continue ;;
    --overwrite) overwrite=yes; shift; continue ;;
    -o|--parts|--samples|--cpus|--mem|--time|--retries|--program|--formats|--sbatch) [ $# -ge 2 ] || fail "$1 needs a value" ;;
    -*) fail "unknown option $1" ;;
    *) [ -z "$plan" ] || fail "one plan, not $plan and $1"; plan=$1; shift; continue ;;
  esac
  case $1 in
    -o) output=$2 ;; --parts) parts=$2 ;; --samples) samples=$2 ;; --cpus) cpus=$2 ;; --mem) mem=$2 ;; --time) minutes=$2 ;;
    --retries) retries=$2 ;; --program) program=$2 ;; --formats) formats=$2 ;; --sbatch) extra=$2 ;;
  esac
  shift 2
done
[ -n "$plan" ] || fail "which plan? submit.sh PLAN -o OUTPUT"
[ -n "$output" ] || fail "where to? submit.sh PLAN -o OUTPUT"
program=${program:-$(command -v cordillera)} || fail "cordillera is not in PATH; say --program"
for number in "$parts" "$samples" "$cpus" "$retries"; do
  case $number in ''|*[!0-9]*) fail "'$number' is no whole number" ;; esac
done
case $mem in *[!0-9]*) fail "'$mem' is no whole number" ;; esac
# Said now: publish would refuse after hours.
taken() {
  case $output in /vsi*) "$program" info "$output" > /dev/null 2>&1 ;; *) [ -f "$output" ] || [ -n "$(ls -A "$output" 2> /dev/null)" ] ;; esac
}
if [ -z "$overwrite" ] && taken; then fail "$output is there already; --overwrite replaces it"; fi
stages=$("$program" tasks "$plan" --json)  # [{"stage": 0, "tasks": 12, "done": 0, "cost": 2.0e8, "memory_mib": 1024}, ...]
case $plan in /vsi*) logs=. ;; *) logs=$plan/log; mkdir -p "$logs" ;; esac

# How jobs of this plan are told from others: numbers may be given again after a controller forgot some.
case $plan in /vsi*) mark="cordillera ${plan%/}" ;; *) mark="cordillera $(realpath "$plan")" ;; esac  # as in status.sh
queued() { squeue --me --noheader --format='%i|%k' | while IFS='|' read -r job comment; do [ "$comment" != "$mark" ] || echo "$job"; done; }
if [ -z "$dry" ]; then
  there=$(queued)
  if [ -n "$there" ] && [ -z "$again" ]; then
    fail "the queue has jobs of this plan ($(echo "$there" | head -n 3 | tr '\n' ' ')...): status.sh says how far they are, --again takes them back first"
  fi
  for job in $there; do scancel "$job"; done
  case $plan in /vsi*) ;; *) : > "$logs/submitted" ;; esac  # status.sh leaves out older logs
fi

# Slurm starts a job that a node lost again by itself (--requeue). One that ends with 75, or by a signal, puts itself back.
body() {  # command, MiB
  cat <<EOF
#!/bin/sh
echo "submit.sh: begins" >&2
$1
code=\$?
echo "submit.sh: ended with \$code" >&2
if [ \$code -eq 137 ]; then echo "cordillera: killed (137), as when there is too little memory: --mem says how much, here $2 MiB" >&2; fi
if { [ \$code -eq 75 ] || [ \$code -gt 128 ]; } && [ "\${SLURM_RESTART_COUNT:-0}" -lt $retries ]; then
  echo "ended with \$code: trying again, time \$((\${SLURM_RESTART_COUNT:-0} + 1)) of $retries" >&2
  scontrol requeue "\$SLURM_JOB_ID" && sleep 60
fi
exit \$code
EOF
}
quoted() { printf "'%s'" "$(printf '%s' "$1" | sed "s/'/'\\\\''/g")"; }

submit() {  # name, command, MiB, further words
  name=$1 command=$2 memory=$3
  shift 3
  if [ -n "$dry" ]; then
    echo "sbatch --job-name=$name --mem=$memory $* : $command" >&2
    echo 0
    return
  fi
  # shellcheck disable=SC2086  # words are meant to be split
  body "$command" "$memory" | sbatch --parsable --requeue --open-mode=append --job-name="$name" --comment="$mark" --mem="$memory" --cpus-per-task="$cpus" $extra "$@"
}

before= listed=
echo "$stages" | tr -d ' \n[]' | tr '}' '\n' | sed -n 's/.*"stage":\([0-9]*\),"tasks":\([0-9]*\),"done":\([0-9]*\),"cost":\([0-9.e+]*\),"memory_mib":\([0-9]*\).*/\1 \2 \3 \4 \5/p' > "${TMPDIR:-/tmp}/submit.$$"
trap 'rm -f "${TMPDIR:-/tmp}/submit.$$"' EXIT
while read -r stage tasks ended cost least; do
  listed=yes
  if [ "$ended" -eq "$tasks" ]; then
    echo "stage $stage: $tasks tasks, done"
    continue
  fi
  memory=$((least + 512 * (cpus - 1)))
  if [ -n "$mem" ] && { [ "$mem" -gt "$memory" ] || [ "$least" -le 1024 ]; }; then memory=$mem; fi
  count=$(awk -v cost="$cost" -v each="$samples" -v tasks="$tasks" -v most="$parts" \
    'BEGIN { n = int(cost / each + 0.999); if (n > tasks) n = tasks; if (n > most) n = most; print n < 1 ? 1 : n }')
  limit=${minutes:-$(awk -v cost="$cost" -v n="$count" 'BEGIN { m = int(cost / n / 100000 / 60 * 3); print m < 10 ? 10 : m }')}
  device="--device cpu" gres=
  if [ -n "$gpu" ] && [ "$stage" = 0 ]; then device="--device cuda" gres=--gres=gpu:1; fi
  job=$(submit "cordillera-$stage" "$(quoted "$program") work $(quoted "$plan") --stage $stage --part \$SLURM_ARRAY_TASK_ID/$count --threads $cpus --memory $memory $device" "$memory" \
    --array="0-$((count - 1))" --time="$limit" --output="$logs/stage-$stage-%a.log" $gres ${before:+--dependency=afterok:$before --kill-on-invalid-dep=yes})
  echo "stage $stage: $tasks tasks in $count parts, job $job"
  before=$job
done < "${TMPDIR:-/tmp}/submit.$$"
[ -n "$listed" ] || fail "$plan has no stages"
job=$(submit cordillera-publish "$(quoted "$program") publish $(quoted "$plan") -o $(quoted "$output")${overwrite:+ --overwrite}${formats:+ --formats $(quoted "$formats")}" "${mem:-1024}" \
  --output="$logs/publish.log" --time="${minutes:-240}" ${before:+--dependency=afterok:$before --kill-on-invalid-dep=yes})
echo "publish: job $job"
