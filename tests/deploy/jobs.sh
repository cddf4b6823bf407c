#!/usr/bin/env bash
# What a plan becomes for Kubernetes and AWS Batch, against their schemas, and done as they would do it: tests/deploy/jobs.sh BUILD
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/deploy/jobs.sh BUILD}" && pwd)
. "$here/../real_server.sh" 'The test of Kubernetes and AWS Batch'
need_node
modules=$build/jobs
node_modules "$here/jobs" "$modules"
cp "$here/jobs/kubernetes.mjs" "$modules"

program=$build/bin/cordillera
deploy=$repository/deploy
python3 "$here/../slurm/make_rasters.py" "$work/dem" 12
"$program" plan "$work/dem" -o "$work/plan" --name jobs --max-level 13 --error 4 --vertical-datum ellipsoid -q
words=("$work/plan" -o "$work/out" --image example.org/cordillera:1 --samples 1000000 --env AWS_REGION=eu-central-1 --program "$program")
"$deploy/kubernetes/jobs.py" "${words[@]}" --gpu --secret keys --volume claim:/data --scratch 7 > "$modules/jobs.yaml"
node "$modules/kubernetes.mjs" "$modules/jobs.yaml"
"$deploy/aws-batch/jobs.py" "${words[@]}" --gpu --queue queue --role arn:aws:iam::123456789012:role/cordillera --into "$work/requests"
aws=0
python3 "$here/jobs/aws.py" "$work/requests" || aws=$?
((aws == 0 || aws == 77)) || exit 1

# The arguments themselves, each index as Kubernetes would start it, the last one first.
"$deploy/kubernetes/jobs.py" "${words[@]}" > "$work/jobs.yaml"
python3 - "$program" "$work/jobs.yaml" << 'EOF'
import json, os, subprocess, sys
program, file = sys.argv[1:]
for text in ("\n" + open(file, encoding="utf-8").read()).split("\n---\n")[1:]:
    spec = json.loads(text)["spec"]
    for index in reversed(range(spec["completions"])):
        subprocess.run([program] + spec["template"]["spec"]["containers"][0]["args"], check=True, env={**os.environ, "JOB_COMPLETION_INDEX": str(index)})
EOF
"$program" build "$work/dem" -o "$work/one" --name jobs --max-level 13 --error 4 --vertical-datum ellipsoid -q
diff -r -x manifest.json "$work/one" "$work/out"
code=0
JOB_COMPLETION_INDEX=99 "$program" work "$work/plan" --stage 0 --part array/3 -q 2> "$work/said" || code=$?
[[ $code == 2 ]]
grep -q 99/3 "$work/said"
# A plan that cannot be read is told in the program's words.
code=0
"$deploy/kubernetes/jobs.py" "$work/none" "${words[@]:1}" > "$work/nothing.yaml" 2> "$work/said" || code=$?
[[ $code != 0 ]]
grep -q "$work/none" "$work/said"
if grep Traceback "$work/said"; then exit 1; fi

# run.sh, started again while the first stage runs: that Job is not touched but to be resumed, and the others are made.
PATH=$here/jobs/made:$PATH JOBS=$work/cluster python3 "$here/jobs/made/kubectl" begin "$(sed -n 's/^    "name": "\(.*\)",$/\1/p' "$work/jobs.yaml" | head -n 1)"
PATH=$here/jobs/made:$PATH JOBS=$work/cluster "$deploy/kubernetes/run.sh" "$work/jobs.yaml" -n there > "$work/said"
if grep suspended "$work/said"; then exit 1; fi
[[ $(ls "$work/cluster") == "$(sed -n 's/^    "name": "\(.*\)",$/\1/p' "$work/jobs.yaml" | sort)" ]]
if grep -L '"complete"' "$work"/cluster/* | grep .; then exit 1; fi

# What is done is left out.
"$deploy/kubernetes/jobs.py" "${words[@]}" > "$work/again.yaml"
[[ $(grep -c '^    "name": "' "$work/again.yaml") == 1 ]]
"$deploy/aws-batch/jobs.py" "${words[@]}" --queue queue --into "$work/requests"
[[ $(ls "$work/requests") == $'definition.json\npublish.json' ]]
mkdir "$work/bin"
printf '#!/bin/sh\necho "$@" >> "%s"\necho job\n' "$work/aws" > "$work/bin/aws"
chmod +x "$work/bin/aws"
PATH=$work/bin:$PATH "$deploy/aws-batch/submit.sh" "$work/requests" > /dev/null
[[ $(grep -c submit-job "$work/aws") == 1 ]]
if grep dependsOn "$work/aws"; then exit 1; fi
exit $aws
