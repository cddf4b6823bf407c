#!/usr/bin/env bash
# A plan under another spelling is the same plan: neither submitted twice nor missed in the queue. With a made Slurm and a made program.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/../processes.sh"
slurm=$here/../../deploy/slurm
cd "$work"
. "$here/../server/says.sh"
mkdir -p bin folder/plan folder/other
ln -s folder link
cat >bin/cordillera <<'EOF'
#!/bin/sh
[ "${3:-}" != --json ] || echo '[{"stage":0,"tasks":12,"done":0,"cost":2.0e8,"memory_mib":1024}]'
EOF
cat >bin/sbatch <<'EOF'
#!/bin/sh
for word; do case $word in --comment=*) echo "$$|${word#--comment=}" >>"$QUEUE" ;; esac; done
echo $$
EOF
cat >bin/squeue <<'EOF'
#!/bin/sh
[ ! -e "$QUEUE" ] || case $* in *%j*) sed 's/|/ job PENDING None|/' "$QUEUE" ;; *) cat "$QUEUE" ;; esac
EOF
cat >bin/scancel <<'EOF'
#!/bin/sh
sed -i "/^$1|/d" "$QUEUE"
EOF
chmod +x bin/*
export PATH=$work/bin:$PATH QUEUE=$work/queue
program=$slurm/submit.sh

# same SPELLING...: whichever is submitted first, none of the others is submitted, and status.sh sees the jobs.
same() {
  local first other
  for first; do
    rm -f queue
    says 0 'stage 0: 12 tasks in 5 parts' "$first" -o out
    for other; do
      says 2 'the queue has jobs of this plan' "$other" -o out
      "$slurm/status.sh" "$other" >said 2>&1 || fail "status.sh $other fails"
      grep -q PENDING said || fail "status.sh $other does not see the jobs of $first"
    done
  done
}
same "$work/folder/plan" "$work/folder/plan/" "$work/link/plan" "$work/folder/other/../plan" folder/plan link/plan/
same /vsis3/bucket/plan /vsis3/bucket/plan/

# Another plan is another one. --again takes back what was submitted under another name.
rm queue
says 0 '' folder/plan -o out
says 0 '' folder/other -o out
[[ $(wc -l <queue) == 4 ]] || fail 'another plan is not submitted'
cp queue before
says 0 '' link/plan/ -o out --again
[[ $(wc -l <queue) == 4 ]] || fail '--again does not take back the jobs of the plan'
if cmp -s queue before; then fail '--again submits nothing'; fi
