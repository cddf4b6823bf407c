#!/usr/bin/env bash
# systemd reads deploy/cordillera.service without a complaint, and finds it hardened: unit_file.sh BUILD.
# Exits with 77 where systemd-analyze is missing.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$(cd "${1:?usage: tests/deploy/unit_file.sh BUILD}" && pwd)
command -v systemd-analyze >/dev/null || { printf 'The test of the systemd unit is left out; missing: systemd-analyze\n'; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed "s#/usr/bin/cordillera#$build/bin/cordillera#" "$root/deploy/cordillera.service" >"$work/cordillera.service"
systemd-analyze verify "$work/cordillera.service" 2>&1 | grep "^$work" >"$work/complaints" || true
[[ ! -s $work/complaints ]] || { cat "$work/complaints" >&2; exit 1; }
# 0 is safest, 10 is not at all; tenths. Without the hardening it is above 90.
if [[ $(systemd-analyze security --help) == *--offline* ]]; then
  systemd-analyze security --no-pager --offline=true --threshold=15 "$work/cordillera.service" >"$work/report" || { tail -3 "$work/report" >&2; exit 1; }
  tail -1 "$work/report"
fi
# The settings beside it are settings.
printf 'data = %s/data\nlisten = 127.0.0.1:0\n' "$work" >"$work/own"
grep -v '^listen' "$root/deploy/cordillera.conf" >>"$work/own"
"$build/bin/cordillera" doctor --config "$work/own" --json >"$work/doctor.json" || true
python3 - "$work/doctor.json" <<'PY'
import json, sys
checks = {check["name"]: check for check in json.load(open(sys.argv[1]))["checks"]}
if checks["access"]["health"] != "good" or "build" not in checks:
    sys.exit(f"cordillera doctor does not like deploy/cordillera.conf: {checks}")
PY
