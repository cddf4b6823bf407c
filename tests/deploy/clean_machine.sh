#!/usr/bin/env bash
# The .deb and the .tar.gz on a Debian 12 that has nothing else:  tests/deploy/clean_machine.sh BUILD [mirror]
# Run by hand, as root: debootstrap makes the machine in a temporary folder (some minutes, 1 GB). Needs what deploy/package.sh left in BUILD/packages.
set -euo pipefail
build=$(cd "$1" && pwd)
mirror=${2:-http://deb.debian.org/debian}
fail() { printf 'clean_machine: %s\n' "$*" >&2; exit 1; }
[[ $(id -u) = 0 ]] || { echo "clean_machine: only root can make one"; exit 77; }
command -v debootstrap >/dev/null || { echo "clean_machine: no debootstrap here (apt-get install debootstrap)"; exit 77; }
deb=$(echo "$build"/packages/*.deb) archive=$(echo "$build"/packages/*.tar.gz)
[[ -f $deb && -f $archive ]] || fail "no packages in $build: deploy/package.sh makes them"

machine=$(mktemp -d)
trap 'umount -l "$machine/proc" "$machine/dev" 2>/dev/null || true; rm -rf --one-file-system "$machine"' EXIT
debootstrap --variant=minbase bookworm "$machine" "$mirror" >"$machine.log" || fail "debootstrap failed, see $machine.log"
cp /etc/resolv.conf /etc/hosts "$machine/etc/"
cp "$deb" "$machine/root/cordillera.deb"
cp "$archive" "$machine/root/cordillera.tar.gz"
printf '#!/bin/sh\nexit 101\n' >"$machine/usr/sbin/policy-rc.d"  # no services in here
chmod +x "$machine/usr/sbin/policy-rc.d"
mount --bind /proc "$machine/proc"
mount --bind /dev "$machine/dev"

cat >"$machine/root/try.sh" <<'EOF'
set -eu
cd /root
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
apt-get install -y -qq --no-install-recommends ./cordillera.deb >/dev/null
cordillera --version
{ printf 'ncols 60\nnrows 60\nxllcorner 10\nyllcorner 46\ncellsize 0.01\n'; for r in $(seq 60); do seq -s ' ' "$r" $((r + 59)); done; } >dem.asc
words="--crs EPSG:4326 --vertical-datum EGM96 --error 1 -q"
cordillera build dem.asc -o deb.sqlite $words
cordillera check deb.sqlite
cordillera doctor --data data >doctor || { cat doctor; exit 1; }
cordillera serve --data data --listen 127.0.0.1:18999 2>log &
server=$!
until grep -q listening log; do sleep 0.1; done
exec 3<>/dev/tcp/127.0.0.1/18999
{ printf 'POST /v1/datasets?name=dem.asc&crs=EPSG:4326&vertical_datum=EGM96&error=1 HTTP/1.1\r\nHost: 127.0.0.1\r\nPrefer: wait=120\r\n'
  printf 'Connection: close\r\nContent-Length: %d\r\n\r\n' "$(stat -c %s dem.asc)"; cat dem.asc; } >&3
head -1 <&3 | grep ' 201 '
kill $server
wait $server
mkdir unpacked && tar -xzf cordillera.tar.gz -C unpacked
unpacked/cordillera-*/bin/cordillera build dem.asc -o archive.sqlite $words
cmp deb.sqlite archive.sqlite
apt-get remove -y -qq cordillera >/dev/null
[ ! -e /usr/bin/cordillera ] && [ -e data/registry.sqlite ]
EOF
chroot "$machine" bash /root/try.sh || fail "it does not work on a clean machine"
echo "clean_machine: installed, built, served and removed"
