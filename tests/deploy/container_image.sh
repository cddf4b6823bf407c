#!/usr/bin/env bash
# The container files, built and run as their own comments say:  tests/deploy/container_image.sh BUILD [BASE]
# Run by hand, as root: podman does what docker does, without a daemon, in a temporary folder (some minutes, 2 GB). Needs podman, crun,
# iproute2 and what deploy/package.sh left in BUILD/packages.
# BASE: a .tar of a bare Debian 12 that stands for debian:12-slim. Without it the image comes from its registry, and where that is out of
# reach, mmdebstrap or debootstrap makes such a system.
set -euo pipefail
build=$(cd "$1" && pwd)
base=${2:-}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
. "$here/../real_server.sh" container_image
fail() { printf 'container_image: %s\n' "$*" >&2; exit 1; }
[[ $(id -u) = 0 ]] || leave_out 'root, who alone can make a system'
for program in podman crun ip curl; do command -v $program >/dev/null || leave_out "$program (apt-get install podman crun iproute2 curl)"; done
archive=$(echo "$build"/packages/*.tar.gz)
[[ -f $archive ]] || fail "no archive in $build: deploy/package.sh makes it"

# vfs and cgroupfs ask nothing of the kernel and of systemd.
podman=(podman --root "$work/images" --runroot "$work/run" --tmpdir "$work/tmp" --storage-driver vfs --cgroup-manager cgroupfs --events-backend file --log-level fatal)
name=debian:12-slim
if [[ -n $base ]]; then
  from="the Debian of $base"
elif "${podman[@]}" pull --quiet $name >"$work/pull.log" 2>&1; then
  from='the image of its registry'
else
  base=$work/base.tar from='a bare Debian 12 in the place of debian:12-slim'
  if command -v mmdebstrap >/dev/null; then
    mmdebstrap --quiet --variant=minbase bookworm "$base" http://deb.debian.org/debian >"$work/base.log" 2>&1
  elif command -v debootstrap >/dev/null; then
    debootstrap --variant=minbase bookworm "$work/base" http://deb.debian.org/debian >"$work/base.log" 2>&1 && tar -C "$work/base" -cf "$base" .
  else
    leave_out "a registry ($(tail -n 1 "$work/pull.log")), mmdebstrap or debootstrap"
  fi || leave_out "a mirror with bookworm: $(tail -n 1 "$work/base.log")"
fi
if [[ -n $base ]]; then "${podman[@]}" import --quiet "$base" $name >/dev/null 2>&1 || fail "$base could not be imported"; fi

# The files' own lines, in a folder that looks like the repository.
mkdir -p "$work/folder/build"
ln -s "$repository/deploy" "$work/folder/deploy"
ln -s "$build" "$work/folder/build/release"
cd "$work/folder"
"$build/bin/cordillera" build deploy/sample/white_mountains_srtm3.tif -o "$work/tiles/" --quiet || fail "the program itself makes no tiles"
docker() { "${podman[@]}" "$1" --isolation chroot --pull=never --format docker --quiet "${@:2}" >"$work/build.log" 2>&1 || { cat "$work/build.log" >&2; fail "no image"; }; }
for file in deploy/Dockerfile deploy/Dockerfile.cuda; do
  seconds=$SECONDS
  eval "$(sed -n 's/^#   \(docker build\)/\1/p' "$file" | tail -n 1)"
  # An own network, whose port 8080 is free. With its first process all others of it end, and what was mounted is gone.
  unshare --mount --net --pid --fork --kill-child --mount-proc bash "$here/container_image_inside.sh" "$file" "$work/tiles" "${podman[@]}" ||
    fail "the image of $file does not work"
  printf '%s, on %s: built and run in %s s\n' "$file" "$from" $((SECONDS - seconds))
done
