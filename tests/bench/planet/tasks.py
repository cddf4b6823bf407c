"""What schedule.py, measure.py and emulate.sh know of a plan: how much of each block rasters cover, how long tasks take by what was measured,
and how submit.sh and `work --part` cut a stage."""
import json
import os

TOP = 21              # windows of rasters are on the lattice of the finest level there can be
MERGE_COST = 1 << 23  # as `cordillera tasks` tells it
FULL = 0.9            # share of a block that rasters must cover for its time to stand for full ones
LEAST = 0.2           # core seconds of the emptiest block


def read_plan(folder):
    with open(os.path.join(folder, "plan.json"), encoding="utf-8") as file:
        return json.load(file)


def place(task):
    """Zeros are left out of a plan."""
    return task.get("level", 0), task.get("x", 0), task.get("y", 0)


def covered(plan):
    """Share of each block's own tile that rasters cover, for rasters that do not overlap."""
    units = 256 << (TOP - plan["plan"]["block_level"])
    shares = []
    for task in plan["stages"][0]["tasks"]:
        _, x, y = place(task)
        west, south, area = x * units, y * units, 0.0
        for k in task["sources"]:
            w = plan["sources"][k]["window"]
            up = min(w[3], south + units) - max(w[1], south)
            across = (min(w[2] - turn, west + units) - max(w[0] - turn, west) for turn in (0, 512 << TOP))
            area += sum(max(0, part) for part in across) * max(0, up)
        shares.append(min(1.0, area / units / units))
    return shares


def samples_of(plan, share):
    """Of the finest level, that a block of this share has."""
    return share * float(256 << (plan["plan"]["finest_level"] - plan["plan"]["block_level"])) ** 2


def children(plan, number):
    """Of the task above the blocks: as how many tiles it costs, which are merged by fours; all levels together."""
    blocks = len(plan["stages"][number - 1]["tasks"])
    return [blocks * 4 / 3 for _ in plan["stages"][number]["tasks"]]


class Times:
    """Measured tasks (measure.py): each task of a plan takes as long as one of them, chosen by its key."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            measured = json.load(file)
        self.full = [row for row in measured["blocks"] if row["share"] >= FULL]
        if not self.full:
            raise SystemExit(f"{path} has no block that rasters cover to {FULL:.0%}")
        self.merges = measured["merges"]
        if not self.merges:
            raise SystemExit(f"{path} has no task above blocks")
        self.publish = measured["publish"]

    def _drawn(self, rows, task):
        return rows[int(task["key"][:8], 16) % len(rows)]

    def block(self, plan, task, share):
        """Core seconds, and bytes of its shard."""
        row = self._drawn(self.full, task)
        part = samples_of(plan, share) / row["samples"]
        return max(LEAST, part * row["seconds"]), part * row["bytes"]

    def merge(self, task, joined):
        row = self._drawn(self.merges, task)
        return row["seconds"] * joined / row["children"], row["bytes"] * joined / row["children"]

    def stages(self, plan):
        """For each stage, its tasks' core seconds and bytes."""
        first = [self.block(plan, task, share) for task, share in zip(plan["stages"][0]["tasks"], covered(plan))]
        above = [[self.merge(task, joined) for task, joined in zip(stage["tasks"], children(plan, number))]
                 for number, stage in enumerate(plan["stages"]) if number > 0]
        return [first] + above


def cost(task):
    return task["samples"] if "sources" in task else MERGE_COST


def parts_of(costs, samples, most):
    """Into how many parts submit.sh cuts a stage (--samples, --parts)."""
    return max(1, min(int(sum(costs) / samples + 0.999), len(costs), most))


def in_parts(costs, seconds, parts):
    """Seconds of each part, cut as `work --part` cuts."""
    total, before, sums = float(sum(costs)), 0.0, [0.0] * parts
    for one, time in zip(costs, seconds):
        sums[min(parts - 1, int((before + one / 2) / total * parts))] += time
        before += one
    return sums
