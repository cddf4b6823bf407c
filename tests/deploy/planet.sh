#!/usr/bin/env bash
# The planet's scripts on a small part of it: tests/deploy/planet.sh BUILD [--emulate]. The cells are planned, and the table's hours are those that the
# cells' area gives. With --emulate, a minute more, the plan's parts run on an emulated cluster of two nodes where Slurm and munge are installed.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$(cd "${1:?usage: tests/deploy/planet.sh BUILD}" && pwd)/bin/cordillera
planet=$here/../bench/planet
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*" >&2; exit 1; }

"$planet/cells.py" cells 300
"$program" plan cells/list.txt -o plan --error 10 --max-level 12 --name planet -q
"$program" plan cells/list.txt -o again --error 10 --max-level 12 --name planet -q
cmp plan/plan.json again/plan.json
"$program" plan cells/list.txt -o one --error 10 --max-level 12 --name planet -q --threads 1
python3 -c 'import json; a, b = (json.load(open(f"{name}/plan.json")) for name in ("plan", "one")); assert a["stages"] == b["stages"] and a["sources"][7]["window"] == b["sources"][7]["window"]'

# Every full block of 4096 x 4096 samples takes 10 s and leaves 4 MB, a merge 2 s and 1 MB, publish 1 s for 100 MB.
cat > times.json << 'END'
{"blocks": [{"stage": 0, "task": 0, "seconds": 10, "bytes": 4000000, "share": 1.0, "samples": 16777216},
            {"stage": 0, "task": 1, "seconds": 1, "bytes": 1, "share": 0.1, "samples": 1677721}],
 "merges": [{"stage": 1, "task": 0, "seconds": 2, "bytes": 1000000, "children": 4}],
 "publish": {"seconds": 1, "shard_bytes": 100000000, "bytes": 90000000, "tasks": 3}}
END
"$planet/schedule.py" plan --times times.json --nodes 1,2,64 --cores 4 --start 0 --barrier 0 --starts 1e9 | tee table
mkdir sleeps
"$planet/schedule.py" plan --times times.json --parts 40 --start 0 --sleeps sleeps
python3 - << 'END'
import json, re
plan, table = json.load(open("plan/plan.json")), open("table").read()
tasks = [len(stage["tasks"]) for stage in plan["stages"]]
merges = sum(tasks[1:])
assert f"300 rasters; {tasks[0]} blocks" in table and f" {merges} merges in {len(tasks) - 1} stages" in table, "what is in the plan"
# A block is 0.703125 degrees a side; cells without sea between them cover 300 square degrees.
blocks = 300 / 0.703125 ** 2 * 10
hours = float(re.search(r"blocks ([0-9.]+), merges", table)[1])
assert abs(hours * 3600 - blocks) < 0.06 * 3600, (hours * 3600, blocks)
rows = {int(cells[1]): cells for cells in (line.split("|") for line in table.splitlines()) if len(cells) > 5 and cells[1].strip().isdigit()}
seconds = {nodes: float(cells[3]) * 60 for nodes, cells in rows.items()}
assert abs(seconds[1] * 4 / blocks - 1) < 0.05 and abs(seconds[2] * 8 / blocks - 1) < 0.08, (seconds, blocks)
assert seconds[64] >= 10 - 3, seconds  # no shorter than one block, whatever the number of nodes
assert float(rows[1][8].strip(" %")) > 60 > float(rows[64][8].strip(" %")), rows  # one task makes all above the blocks
sleeps = [float(line) for line in open("sleeps/stage-0-of-40")]
assert len(sleeps) == 40 and abs(sum(sleeps) / blocks - 1) < 0.02, (len(sleeps), sum(sleeps), blocks)
END

[[ ${2:-} == --emulate ]] || exit 0
for need in slurmctld slurmd sbatch munged; do
  command -v $need > /dev/null || { echo "the emulated cluster is left out: $need is not installed"; exit 0; }
done
"$planet/emulate.sh" plan times.json 2 --cores 2 --seconds 5 --parts 12 --program "$program" | tee emulated
parts=$("$program" tasks plan --json | python3 -c '
import json, sys
print(sum(min(12, s["tasks"], max(1, int(s["cost"] / 4e7 + 0.999))) for s in json.load(sys.stdin)))')
grep -q "^| 2 | 4 | $parts |" emulated || fail "not $parts jobs have run"
