# Sourced after real_server.sh or something like it: S3 on this host. need_storage HERE BUILD; start_storage FOLDER; kill_storage.
# The environment then says what GDAL needs; $storage_url is the bucket, $storage_log has a line a request.
need_storage() {
  storage_modules=$2/storage
  node_modules "$1" "$storage_modules"
  cp "$1/s3.mjs" "$storage_modules"
  storage_port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
  storage_url=http://127.0.0.1:$storage_port/terrain
  export AWS_S3_ENDPOINT=127.0.0.1:$storage_port AWS_HTTPS=NO AWS_VIRTUAL_HOSTING=FALSE AWS_ACCESS_KEY_ID=S3RVER AWS_SECRET_ACCESS_KEY=S3RVER
}
start_storage() {
  storage_log=$1.log
  mkdir -p "$1"
  local lines=$(($(grep -c '^ready' "$storage_log" 2>/dev/null || true) + 1))
  start node "$storage_modules/s3.mjs" "$1" "$storage_port" >>"$storage_log" 2>&1
  storage_pid=$started
  until [[ $(grep -c '^ready' "$storage_log") -ge $lines ]]; do
    kill -0 "$storage_pid" || { cat "$storage_log" >&2; exit 1; }
    sleep 0.1
  done
}
kill_storage() { kill -KILL "$storage_pid" 2>/dev/null || true; stop "$storage_pid" || true; }
