#!/usr/bin/env bash
# What plan, tasks and work do with memory, bad rasters, what is left behind and what may not be read: tests/server/work_line.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$(cd "${1:?usage: tests/server/work_line.sh BUILD}" && pwd)/bin/cordillera
. "$here/../processes.sh"
cd "$work"
. "$here/says.sh"
options=(--max-level 13 --error 4 --vertical-datum ellipsoid -q)
python3 "$here/../slurm/make_rasters.py" dem 12
says 0 '' plan dem -o plan "${options[@]}"

# Memory: of the line, of the environment, of the plan. A stage says what it takes.
says 2 'less than 96' work plan --memory 5
CORDILLERA_MEMORY=5 says 2 'CORDILLERA_MEMORY.*less than 96' work plan
CORDILLERA_ERROR=nonsense says 0 '' work plan --memory 500 -q
says 0 '"memory_mib": *1024' tasks plan --json
# Threads and device likewise, and what is wrong with them is told before any task.
for words in '--threads -1' '--threads x' '--device foo'; do says 2 'accepted: ' work plan $words; done
CORDILLERA_THREADS=x says 2 'CORDILLERA_THREADS' work plan
CORDILLERA_DEVICE=foo says 2 'CORDILLERA_DEVICE.*cuda:all' work plan
for part in array 1 array/ /3; do says 2 "part='$part' is no K/N.*array/N" work plan --stage 0 --part $part; done
SLURM_ARRAY_TASK_ID=4 says 2 "part='array/3', here 4/3 is no K/N" work plan --stage 0 --part array/3
says 0 '' plan dem -o small "${options[@]}" --memory 300
grep -q '"memory": *300' small/plan.json || fail 'the plan does not pass its memory on'

# Schedulers are told it, stage by stage, and so is work. Stages that are done are left out.
cat > listed << 'EOF'
#!/bin/sh
echo '[{"stage":0,"tasks":12,"done":DONE,"cost":2.0e8,"memory_mib":1024},{"stage":1,"tasks":1,"done":0,"cost":1.0e7,"memory_mib":2560}]'
EOF
sed -e 's/DONE/12/' listed > all_blocks && sed -i -e 's/DONE/3/' listed && chmod +x listed all_blocks
submit=("$here/../../deploy/slurm/submit.sh" plan -o out --dry-run --program)
"${submit[@]}" "$work/listed" --cpus 2 > said 2>&1
grep -q 'cordillera-0 --mem=1536 .*--memory 1536 ' said || fail 'the memory of blocks'
grep -q 'cordillera-1 --mem=3072 .*--memory 3072 ' said || fail 'the memory of levels above blocks'
grep -q 'cordillera-publish --mem=1024 .*afterok' said || fail 'the memory of publish'
"${submit[@]}" "$work/listed" --mem 600 > said 2>&1
grep -q 'cordillera-0 --mem=600 ' said && grep -q 'cordillera-1 --mem=2560 ' said || fail '--mem takes what levels above blocks need'
"${submit[@]}" "$work/all_blocks" > said 2>&1
grep -q 'stage 0: 12 tasks, done' said && ! grep -q cordillera-0 said || fail 'a stage that is done is submitted'
for kind in kubernetes aws-batch; do
  "$here/../../deploy/$kind/jobs.py" plan -o out --image image --program "$work/listed" --cpus 2 \
    $([[ $kind == kubernetes ]] || echo --queue queue --into requests) > said 2>&1
  [[ $kind == kubernetes ]] || cat requests/*.json > said
  for memory in 1536 3072 1024; do grep -q "\"$memory\(Mi\)*\"" said || fail "$kind: there is no $memory"; done
done

# What is in the output's place is replaced only where that is asked for.
mkdir out && echo '{}' > out/manifest.json
submits() {  # kind, further words
  local kind=$1
  shift
  case $kind in
    slurm) "${submit[@]}" "$work/listed" "$@" ;;
    kubernetes) "$here/../../deploy/kubernetes/jobs.py" plan -o out --image image --program "$work/listed" "$@" ;;
    aws-batch) "$here/../../deploy/aws-batch/jobs.py" plan -o out --image image --program "$work/listed" --queue queue --into requests "$@" && cat requests/publish.json ;;
  esac
}
for kind in slurm kubernetes aws-batch; do
  submits $kind > said 2>&1 && fail "$kind replaces what is there"
  grep -q 'out is there already; --overwrite replaces it' said || fail "$kind does not say that the output is there"
  submits $kind --overwrite > said 2>&1 && grep -q -e --overwrite said || fail "$kind does not tell publish to replace"
done
rm -r out
for kind in slurm kubernetes aws-batch; do
  submits $kind > said 2>&1 || fail "$kind refuses a place that is free"
  if grep -q -e --overwrite said; then fail "$kind replaces without being asked"; fi
done

# A damaged shard is named and goes, so that schedulers have it done again.
says 0 '' work plan -q
shard=$(find plan/shards -name '*.shard' -size +1k | head -n 1)
truncate -s -1 "$shard"
says 75 'is damaged, and was removed: plan/shards/' publish plan -o out.sqlite
"$program" tasks plan --json > said
python3 -c 'import json, sys; sys.exit(all(s["done"] == s["tasks"] for s in json.load(open("said"))))' || fail 'a shard that was damaged counts as done'

# A shard without bytes is none, and publish says so.
says 0 '' work plan -q
shard=$(find plan/shards -name '*.shard' | head -n 1)
: > "$shard"
says 75 '1 task has not been done' publish plan -o out.sqlite
says 0 '' work plan -q
says 0 '' publish plan -o out.sqlite -q

# One bad raster: the other tasks are done, each reason is named once.
rm -r plan/shards
mv dem/dem00.asc away.asc
says 1 'cordillera: .*dem00.asc' work plan --stage 0
grep -q failed said || fail 'a failed task does not say so'
[[ -n $(find plan/shards -name '*.shard') ]] || fail 'the others were not done'
mv away.asc dem/dem00.asc
says 0 '' work plan -q

# What others may not read is told so. root may read all.
if [[ $(id -u) != 0 ]] || setpriv --reuid 65534 --regid 65534 --clear-groups true 2> /dev/null; then
  as_other() { if [[ $(id -u) == 0 ]]; then setpriv --reuid 65534 --regid 65534 --clear-groups "$@"; else "$@"; fi; }
  chmod 755 "$work"
  chmod 000 plan/shards
  (cd / && as_other "$program" tasks "$work/plan") > said 2>&1 && code=0 || code=$?
  chmod 755 plan/shards
  [[ $code == 75 ]] && grep -q 'shards cannot be read: Permission denied' said || fail "tasks ends with $code"
  cp dem/dem01.asc closed.asc && chmod 000 closed.asc
  (cd / && as_other "$program" info "$work/closed.asc") > said 2>&1 || true
  (cd / && as_other "$program" plan "$work/closed.asc" --dry-run) > said 2>&1 && code=0 || code=$?
  [[ $code == 1 ]] && grep -q 'closed.asc cannot be read: Permission denied' said || fail "plan ends with $code"
  rm -f closed.asc
  mkdir -p sheets/locked && cp dem/dem00.* sheets && chmod 000 sheets/locked
  (cd / && as_other "$program" info "$work/sheets") > said 2>&1 && code=0 || code=$?
  [[ $code == 1 ]] && grep -q 'sheets/locked cannot be read: Permission denied' said || fail "a folder in a folder: info ends with $code"
  rm -r sheets
fi

# Folders of processes that are gone are removed, and no others.
export TMPDIR=$work/temporary
sleep 0 & gone=$!
wait "$gone"
left=$TMPDIR/cordillera-of-$(hostname)-$gone-abcde own=$TMPDIR/cordillera-of-$(hostname)-$$-abcdef other=$TMPDIR/cordillera-of-elsewhere-$gone-abcdef
mkdir -p "${left}f/within" "$own" "$other" "${left}g"  # the last is one of another container's process
exec 9< "${left}g" && flock -s 9
says 0 '' work plan -q
[[ ! -e ${left}f ]] || fail 'the folder of a process that is gone stays'
[[ -e $own && -e $other && -e ${left}g ]] || fail 'a folder of another process, or machine, was removed'
exec 9<&-
says 0 '' work plan -q
[[ ! -e ${left}g ]] || fail 'a folder whose lock has ended stays'
rmdir "$own" "$other"

# A hangup stops as a termination does, and leaves no unpacked archive.
python3 - << 'EOF'
import math, zipfile
side = 1500
rows = "\n".join(" ".join(str(int(900 + 300 * math.sin(r / 9) * math.cos(c / 7))) for c in range(side)) for r in range(side))
head = f"ncols {side}\nnrows {side}\nxllcorner 8\nyllcorner 46\ncellsize 0.0001\n"
with zipfile.ZipFile("large.zip", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as out:
    out.writestr("large.asc", head + rows + "\n")
    out.writestr("large.prj", open("dem/dem00.prj", encoding="utf-8").read())
EOF
says 0 '' plan large.zip -o zipped --error 0.5 --vertical-datum ellipsoid -q
start "$program" work zipped --threads 1 -q > said 2>&1
busy=$started
until [[ -n $(find "$TMPDIR" -mindepth 2 -name 'large.asc') ]]; do kill -0 "$busy" 2> /dev/null || fail 'work has ended'; done
kill -HUP "$busy"
wait "$busy" && code=0 || code=$?
[[ $code == 75 ]] || fail "a hangup ends work with $code"
[[ -z $(ls "$TMPDIR") ]] || fail "a hangup leaves $(ls "$TMPDIR")"
