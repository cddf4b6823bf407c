#!/usr/bin/env bash
# deploy/npm: the package of an archive runs the program in it, with its words, its exit code and its signals. The archive is a made one.
# Exits with 77, and says what is missing, where it cannot run.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/../processes.sh"
for need in node npm; do command -v $need >/dev/null || { echo "left out: $need is not installed"; exit 77; }; done
fail() { echo "FAILED: $*" >&2; exit 1; }

name=cordillera-1.2.3-linux-x86_64
mkdir -p "$work/$name/bin" "$work/out"
cat >"$work/$name/bin/cordillera" <<'END'
#!/bin/sh
trap 'echo ended; exit 5' TERM
trap 'echo interrupted' INT
echo "words: $*"
[ "$1" = serve ] || exit 7
while kill -0 "$PPID" 2>/dev/null; do sleep 0.1; done  # not longer than who started it
END
chmod +x "$work/$name/bin/cordillera"
tar -czf "$work/$name.tar.gz" -C "$work" "$name"
export HOME=$work  # npm's own files
[[ $("$here/../../deploy/npm/make.sh" "$work/$name.tar.gz" "$work/out") == cordillera-1.2.3.tgz ]] || fail "another package than that of the archive's version"
"$here/../../deploy/npm/make.sh" "$work/out/cordillera-1.2.3.tgz" "$work/out" 2>/dev/null && fail "what is no archive was packed"
tar -xzf "$work/out/cordillera-1.2.3.tgz" -C "$work/out"
[[ -s $work/out/package/README.md ]] || fail "the package does not say what it is"
run=$work/out/package/cordillera.mjs
code=0
said=$("$run" build "two words") || code=$?
[[ $said == "words: build two words" && $code -eq 7 ]] || fail "it said '$said' and ended with $code"
start "$run" serve >"$work/said"
until grep -q words "$work/said"; do kill -0 "$started"; sleep 0.05; done
# Ctrl+C goes to both. One that is passed on would come before the SIGTERM that follows it.
kill -INT $(<"/proc/$started/task/$started/children")
until grep -q interrupted "$work/said"; do kill -0 "$started"; sleep 0.05; done
kill -INT "$started"
code=0
stop "$started" || code=$?
[[ $code -eq 5 ]] && grep -q ended "$work/said" || fail "a signal did not reach the program: $code"
[[ $(grep -c interrupted "$work/said") -eq 1 ]] || fail "one Ctrl+C came to the program as two"
echo "ok"
