#!/usr/bin/env bash
# The packages on a system that has nothing else:  tests/deploy/clean_machine.sh BUILD [SUITE [MIRROR]]
# Run by hand, as root: mmdebstrap or debootstrap makes the system in a temporary folder (a minute or two, 1 GB). Needs what deploy/package.sh
# left in BUILD/packages. SUITE: bookworm (Debian 12, without it), trixie, or Ubuntu's jammy and noble with Ubuntu's mirror and
# KEYRING=/usr/share/keyrings/ubuntu-archive-keyring.gpg; or a .tar of a system that mmdebstrap has made.
# The .deb is installed on bookworm, the archive is unpacked on all. Prints how many seconds after the unpacking began / showed the sample: its page
# and a tile, and, where Chromium and npm are, its picture (BUILD/first_picture.png).
set -euo pipefail
build=$(cd "$1" && pwd)
suite=${2:-bookworm}
mirror=${3:-http://deb.debian.org/debian}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/../real_server.sh" clean_machine
fail() { printf 'clean_machine: %s\n' "$*" >&2; exit 1; }
[[ $(id -u) = 0 ]] || leave_out 'root, who alone can make a system'
deb=$(echo "$build"/packages/*.deb) archive=$(echo "$build"/packages/*.tar.gz)
[[ -f $deb && -f $archive ]] || fail "no packages in $build: deploy/package.sh makes them"

machine=$work/machine
mkdir "$machine"
if [[ -f $suite ]]; then
  tar -C "$machine" --exclude='./dev/*' -xf "$suite"
elif command -v mmdebstrap >/dev/null; then
  mmdebstrap --variant=minbase ${KEYRING:+--keyring="$KEYRING"} "$suite" "$machine" "$mirror" >"$machine.log" 2>&1
elif command -v debootstrap >/dev/null; then
  debootstrap --variant=minbase ${KEYRING:+--keyring="$KEYRING"} "$suite" "$machine" "$mirror" >"$machine.log" 2>&1
else
  leave_out 'mmdebstrap or debootstrap (apt-get install mmdebstrap)'
fi || leave_out "a mirror with $suite: $(tail -n 1 "$machine.log")"

cp /etc/resolv.conf /etc/hosts "$machine/etc/"
cp "$archive" "$machine/root/cordillera.tar.gz"
if grep -q bookworm "$machine/etc/os-release"; then cp "$deb" "$machine/root/cordillera.deb"; fi
cp "$here/clean_machine_inside.sh" "$machine/root"
printf '#!/bin/sh\nexit 101\n' >"$machine/usr/sbin/policy-rc.d"  # no services in here
chmod +x "$machine/usr/sbin/policy-rc.d"
port=$(free_port)
# With its first process all others of it end, and what was mounted is gone.
inside=(unshare --mount --pid --fork --kill-child bash -c 'mount -t proc proc "$1/proc" && mount --bind /dev "$1/dev" && exec chroot "$@"' _ "$machine")
"${inside[@]}" bash /root/clean_machine_inside.sh "$port" || fail "it does not work on a bare $suite"

# The same in a browser, which stands outside.
(need_node && need_chromium) >/dev/null || { echo "clean_machine: no Chromium or npm here, so no picture"; exit 0; }
need_chromium
modules=$work/npm
node_modules "$here/../browser" "$modules"
cp "$here"/../browser/*.mjs "$modules"
rm -rf "$machine"/root/cordillera-*/
url=http://127.0.0.1:$port since=$(date +%s%3N)
start "${inside[@]}" bash -c 'cd /root && tar -xzf cordillera.tar.gz && exec cordillera-*/bin/cordillera serve --data shown --listen "127.0.0.1:$1"' _ "$port" >"$work/shown.log" 2>&1
at_end kill -KILL "$started"  # unshare hears nothing else while it waits
until_ready "$started" "$work/shown.log"
node "$modules/first_picture.mjs" --chromium "$chromium" --url "$url" --since "$since" --picture "$build/first_picture.png"
