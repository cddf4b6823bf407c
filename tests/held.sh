# For tests that look at a dataset while it is being built: sourced after real_server.sh, with a server that runs and builds nothing.
# hold RASTER [OPTION]...: posts it, and stops its job as soon as there are provisional tiles. $held is the dataset, $held_job its
# process; `kill -CONT` lets the build end.
hold() {
  held=$("$cordillera" post "$1" --quiet --json "${@:2}" | json_id)
  until held_status provisional true; do
    kill -0 "$server_pid"
    held_status state ready && { printf 'the build of %s ended before anybody could look at it\n' "$1" >&2; return 1; }
    sleep 0.02
  done
  held_job=$(cat "/proc/$server_pid/task/"*/children | tr -d ' \n')
  kill -STOP "$held_job"
  at_end resume_held
  held_status state running || held_status state queued
}
resume_held() { kill -CONT "$held_job" 2>/dev/null; }
held_status() { curl -fsS "$url/v1/datasets/$held" | python3 -c 'import json, sys; sys.exit(str(json.load(sys.stdin)[sys.argv[1]]).lower() != sys.argv[2])' "$@"; }
