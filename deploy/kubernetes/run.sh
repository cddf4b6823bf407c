#!/bin/sh
# Runs the Jobs of a plan, each stage after the one below it: deploy/kubernetes/run.sh jobs.yaml [words for kubectl, such as -n NAMESPACE]
# Started again, it goes on: Jobs that are there are left as they are. A stage with failed tasks ends it; after the mending delete that Job
# and start again. What is done is not done twice; jobs.py, run again, leaves it out.
set -eu
file=${1:?which file? run.sh jobs.yaml}
shift
# What is in the file under a name.
document() {
  awk -v line="    \"name\": \"$1\"," '$0 == "---" { if (its) exit; text = ""; next } { text = text $0 "\n" } $0 == line { its = 1 }
    END { if (its) printf "%s", text }' "$file"
}
# shellcheck disable=SC2013  # a name a line
for name in $(sed -n 's/^    "name": "\(.*\)",$/\1/p' "$file"); do
  # Not `apply`: it would suspend a Job that runs, and end its pods.
  there=$(kubectl "$@" get "job/$name" --ignore-not-found -o name)
  [ -n "$there" ] || document "$name" | kubectl "$@" create -f -
  kubectl "$@" patch job "$name" --type merge -p '{"spec": {"suspend": false}}'
  until kubectl "$@" wait "job/$name" --for=condition=Complete --timeout=60s; do
    if kubectl "$@" get "job/$name" -o 'jsonpath={.status.conditions[?(@.type=="Failed")].status}' | grep -q True; then
      echo "run.sh: $name has failed; kubectl logs -l job-name=$name says why; of pods that were OOMKilled kubectl get pods -l job-name=$name does: give jobs.py more --mem" >&2
      exit 1
    fi
  done
done
