#!/usr/bin/env bash
# What the container files say is so: container_file.sh BUILD. The image is built and run by
# container_image.sh, by hand; that the archive runs on a bare Debian is clean_machine.sh's.
set -euo pipefail
build=$(cd "${1:?usage: tests/deploy/container_file.sh BUILD}" && pwd)
. "$(dirname "${BASH_SOURCE[0]}")/../real_server.sh" "The test of the container files"
file=$repository/deploy/Dockerfile
fail() { printf 'container_file: %s\n' "$*" >&2; exit 1; }

version=$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$build/CMakeCache.txt")
[[ cordillera-$version-linux-x86_64.tar.gz == $(sed -n 's/^ADD \(\S*\) .*/\1/p' "$file") ]] || fail "no archive of package.sh has the name that ADD wants"
"$build/bin/cordillera" serve --help-all >"$work/options"
for variable in $(sed -n 's/^ENV //p' "$file"); do
  option=$(sed 's/=.*//; s/^CORDILLERA_/--/; s/_/-/g' <<<"$variable" | tr '[:upper:]' '[:lower:]')
  grep -qE -- "(^|[ ,])$option\b" "$work/options" || fail "serve has no $option"
done

# Kubernetes' runAsNonRoot takes no name, and a volume gets the group of jobs.py.
user=$(sed -n 's/^USER //p' "$file")
[[ $user =~ ^([1-9][0-9]*):([1-9][0-9]*)$ ]] || fail "USER $user is no number of a user and of a group"
grep -q -- "--uid ${BASH_REMATCH[1]} --gid ${BASH_REMATCH[2]} " "$file" || fail "there is no user $user"
grep -q "^GROUP = ${BASH_REMATCH[2]} " "$repository/deploy/kubernetes/jobs.py" || fail "jobs.py has another group"

# Its look at the health of the service, on a service.
start_server "$build"
health() { sed -n 's/^HEALTHCHECK .* CMD //p' "$file" | python3 -c 'import json, subprocess, sys
words = [word.replace("/8080", "/" + sys.argv[1]) for word in json.load(sys.stdin)]
sys.exit(subprocess.run(words).returncode)' "$1"; }
health "${url##*:}" || fail "a service that lives is called dead"
stop "$server_pid"
! health "${url##*:}" 2>/dev/null || fail "a service that is gone is called alive"
echo "the container files say what is so"
