#!/usr/bin/env bash
# The documents of an installation: their links hold, and scripts that they name are there and run. installed_pages.sh BUILD
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(cd "${1:?usage: tests/deploy/installed_pages.sh BUILD}" && pwd)
fail() { printf 'installed_pages: %s\n' "$*" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --component Unspecified --prefix "$work/usr" >"$work/log" || { cat "$work/log" >&2; fail "nothing was installed"; }
pages=$work/usr/share/doc/cordillera
export PYTHONDONTWRITEBYTECODE=1
python3 "$here/../tree/links.py" --folder "$pages"

# Lines of the pages that run a script for clusters find it. Those that run others begin with a clone.
cd "$pages"
scripts=$(grep -hoE '^    deploy/(slurm|kubernetes|aws-batch)/[a-z.]+' docs/machines/many-rasters.md | sort -u)
[[ $(wc -w <<<"$scripts") == 6 ]] || fail "docs/machines/many-rasters.md runs these scripts: $scripts"
for script in $scripts; do [[ -x $script ]] || fail "$script is no program of the installation"; done
for script in deploy/kubernetes/jobs.py deploy/aws-batch/jobs.py; do "$script" --help >/dev/null || fail "$script does not run"; done
for script in deploy/*/*.sh; do sh -n "$script"; done

# The user of the unit is made by what is installed with it.
[[ -z $(find "$work/usr" -name __pycache__) ]] || fail "compiled Python is installed"
user=$(sed -n 's/^User=//p' "$work/usr/lib/systemd/system/cordillera.service")
grep -q "^u $user " "$work/usr/lib/sysusers.d/cordillera.conf" || fail "nobody makes the user $user"
command -v systemd-sysusers >/dev/null || { echo "installed_pages: systemd does not make the user: no systemd-sysusers here"; exit 0; }
mkdir "$work/etc"
systemd-sysusers --root="$work" "$work/usr/lib/sysusers.d/cordillera.conf" >/dev/null 2>"$work/log" || { cat "$work/log" >&2; fail "systemd-sysusers"; }
grep -q "^$user:.*:/var/lib/cordillera:" "$work/etc/passwd" && grep -q "^$user:" "$work/etc/group" || fail "systemd does not make $user"
