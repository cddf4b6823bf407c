# What a test starts ends with it: sourced after `set -euo pipefail`. However the test ends (a failure, a signal, SIGKILL), its processes
# are told so by the kernel; none stays behind to hold a port or the pipe of whoever runs the test.
# Gives $work, a folder that is gone at the end, and:
#   start COMMAND...   in the background: a program, not a function; $started is its process
#   stop PROCESS       SIGTERM, and SIGKILL if that does not help; its exit code
#   at_end COMMAND...  what else is to be done at the end: the last one first, before the processes are stopped
work=$(mktemp -d)
processes=()
last_words=()
started=

start() {
  setpriv --pdeathsig KILL -- "$@" &
  started=$!
  processes+=("$started")
}

stop() {
  local process=$1 other looks code=0 kept=()
  for other in "${processes[@]}"; do [[ $other == "$process" ]] || kept+=("$other"); done
  processes=("${kept[@]}")
  kill -TERM "$process" 2>/dev/null || true
  for ((looks = 0; looks < 1200; ++looks)); do  # a minute
    kill -0 "$process" 2>/dev/null || break
    sleep 0.05
  done
  kill -KILL "$process" 2>/dev/null && printf 'process %s did not end when it was asked to\n' "$process" >&2
  wait "$process" 2>/dev/null || code=$?
  return $code
}

at_end() { last_words=("$(printf '%q ' "$@")" "${last_words[@]}"); }

end_test() {
  local words process
  for words in "${last_words[@]}"; do eval "$words" || true; done
  for process in "${processes[@]}"; do stop "$process" || true; done
  rm -rf "$work"
}
trap end_test EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM
