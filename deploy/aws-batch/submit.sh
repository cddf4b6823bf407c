#!/bin/sh
# Sends what jobs.py wrote: deploy/aws-batch/submit.sh requests/ [words for aws, such as --region eu-central-1]
# Sent again after a failure it costs little: what is done is not done twice; jobs.py, run again, leaves it out.
set -eu
folder=${1:?which folder? submit.sh REQUESTS}
shift
aws "$@" batch register-job-definition --cli-input-json "file://$folder/definition.json" > /dev/null
before=
for request in "$folder"/[0-9]*.json "$folder"/publish.json; do
  [ -e "$request" ] || continue  # all stages are done
  filled=$(sed "s/\"jobId\": \"@.*\"/\"jobId\": \"$before\"/" "$request")
  before=$(aws "$@" batch submit-job --cli-input-json "$filled" --query jobId --output text)
  echo "$(basename "$request" .json): job $before"
done
