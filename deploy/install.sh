#!/usr/bin/env bash
# Installs what is missing of deploy/packages.txt on Debian 12 or 13 or Ubuntu 24.04 (or a system with the same package names).
#   deploy/install.sh            what the build and the tests need; fails when it cannot be installed
#   deploy/install.sh --web      also what the viewer and the browser tests need; says so when it cannot, and goes on
#   deploy/install.sh --clang    also clang and clang-tidy, for tests/fuzz/run.sh and tests/tidy.sh; fails when they cannot be installed
# CUDA is used when it is found and never installed: Debian's own is too old for this code.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

say() { printf 'install: %s\n' "$*"; }
fail() { printf 'install: %s\n' "$*" >&2; exit 1; }

# Names in a list file that dpkg does not know as installed.
missing_of() {
  local name
  while read -r name; do
    if [[ "$(dpkg-query -W -f '${db:Status-Abbrev}' "$name" 2>/dev/null || true)" != ii* ]]; then
      printf '%s\n' "$name"
    fi
  done < <(sed -e 's/#.*//' -e '/^[[:space:]]*$/d' "$1")
}

as_root=()
index_is_fresh=no
prepare_apt() {
  [[ $index_is_fresh == yes ]] && return 0
  command -v apt-get >/dev/null || { say "no apt-get here: these scripts know Debian 12 and systems like it"; return 1; }
  if [[ $EUID -ne 0 ]]; then
    command -v sudo >/dev/null || { say "neither root nor sudo: run as root, or install the packages by hand"; return 1; }
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -qq || { say "apt-get update failed: is the network there?"; return 1; }
  index_is_fresh=yes
}
apt_install() {
  prepare_apt && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# Debian 12 is what the project is tested on; the others have all packages under the same names. Another system usually works, so this is a remark
# and not an end.
check_system() {
  local id=unknown version=unknown
  if [[ -r /etc/os-release ]]; then
    id=$(. /etc/os-release && printf '%s' "${ID:-unknown}")
    version=$(. /etc/os-release && printf '%s' "${VERSION_ID:-unknown}")
  fi
  case "$id $version" in
    'debian 12' | 'debian 13' | 'ubuntu 24.04') ;;
    *) say "this is $id $version; the package names are those of Debian 12 and 13 and Ubuntu 24.04" ;;
  esac
}

# install_required packages.txt
install_required() {
  command -v dpkg-query >/dev/null || fail "no dpkg-query here: install what deploy/$1 names by your system's own means"
  local missing
  mapfile -t missing < <(missing_of "$here/$1")
  if [[ ${#missing[@]} -eq 0 ]]; then
    say "all packages of $1 are there"
    return
  fi
  check_system
  say "installing ${missing[*]}"
  apt_install "${missing[@]}" || fail "could not install: ${missing[*]}"
}

# One by one: a system with its own Node.js, or without Chromium, still gets the other.
install_web() {
  local name
  while read -r name; do
    case $name in
      nodejs | npm) command -v npm >/dev/null && continue ;;
    esac
    say "installing $name (optional)"
    apt_install "$name" || say "could not install $name; going on without it"
  done < <(missing_of "$here/packages-web.txt")
}

for word in "$@"; do
  [[ $word == --web || $word == --clang ]] || fail "unknown argument $word; usage: deploy/install.sh [--web] [--clang]"
done
install_required packages.txt
for word in "$@"; do
  case $word in
    --web) install_web ;;
    --clang) install_required packages-clang.txt ;;
  esac
done
if command -v nvcc >/dev/null || [[ -x /usr/local/cuda/bin/nvcc ]]; then
  say "CUDA found: the CUDA backend will be built in"
else
  say "no nvcc: building for the CPU only"
fi
