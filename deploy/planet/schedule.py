#!/usr/bin/env python3
"""How long a plan takes on so many nodes: list scheduling of its tasks, stage after stage, as submit.sh hands them to Slurm.

  deploy/planet/schedule.py PLAN --blocks 41.0,38.5,52.1 --merge 2.5 [options]      PLAN: a folder that `cordillera plan` wrote

Times come from measured tasks: --blocks are core seconds of full blocks, --merge those of a merge; each task draws one by its key, scaled by
the share of it that rasters cover, so the same plan gives the same table. What is simulated: cores that take the parts of an array in
order, a start of each part (--start: scheduler and reading of the plan), barriers between stages, publish on one core at the end. What is
not: a queue of others, lost nodes, a storage that is slower than --bandwidth."""
import argparse
import heapq
import json
import math
import os


def words():
    given = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    given.add_argument("plan")
    given.add_argument("--nodes", default="16,64,256")
    given.add_argument("--cores", type=int, default=32, help="of a node [32]")
    given.add_argument("--blocks", required=True, help="measured core seconds of full blocks, separated by commas")
    given.add_argument("--merge", type=float, required=True, help="measured core seconds of a merge")
    given.add_argument("--start", type=float, default=5, help="seconds before a part begins to work [5]")
    given.add_argument("--parts", type=int, default=1000, help="of an array, as for submit.sh [1000]")
    given.add_argument("--shard-mb", type=float, required=True, help="measured MB that a full block leaves")
    given.add_argument("--pixel-bytes", type=float, default=1.5, help="of a source pixel as it is stored [1.5]")
    given.add_argument("--publish-mb", type=float, required=True, help="measured MB a second of publish")
    given.add_argument("--requests", type=float, default=8, help="measured requests of a block, beside one for each MB that it reads [8]")
    return given.parse_args()


def covered(plan, stage):
    """Share of each block that rasters cover; they do not overlap here."""
    top = 21  # windows of sources are on the lattice of the finest level there can be
    units = 256 << (top - plan["plan"]["block_level"])
    shares = []
    for task in stage["tasks"]:
        west, south = task["x"] * units, task["y"] * units
        area = 0.0
        for k in task.get("sources", []):
            w = plan["sources"][k]["window"]
            for turn in (0, 512 << top):
                across = min(w[2] - turn, west + units) - max(w[0] - turn, west)
                up = min(w[3], south + units) - max(w[1], south)
                area += max(0, across) * max(0, up)
        shares.append(min(1.0, area / units / units))
    return shares


def drawn(key, times):
    return times[int(key[:8], 16) % len(times)]


def in_parts(costs, seconds, parts):
    """Seconds of each part, cut as `work --part` cuts."""
    total, before, sums = sum(costs), 0.0, [0.0] * parts
    for cost, time in zip(costs, seconds):
        sums[min(parts - 1, int((before + cost / 2) / total * parts))] += time
        before += cost
    return sums


def span(times, workers):
    """When the last of the tasks ends, if a free worker takes the next."""
    free = [0.0] * min(workers, len(times))
    for time in times:
        heapq.heapreplace(free, free[0] + time)
    return max(free)


def main():
    given = words()
    with open(os.path.join(given.plan, "plan.json"), encoding="utf-8") as file:
        plan = json.load(file)
    measured = [float(word) for word in given.blocks.split(",")]
    stages, bytes_in, bytes_out, requests = [], 0.0, 0.0, 0.0
    for number, stage in enumerate(plan["stages"]):
        tasks = stage["tasks"]
        if number == 0:
            shares = covered(plan, stage)
            seconds = [max(0.2, share * drawn(task["key"], measured)) for share, task in zip(shares, tasks)]
            costs = [task["samples"] for task in tasks]
            bytes_out = sum(shares) * given.shard_mb * 1e6
            requests = given.requests * len(tasks)
        else:
            seconds, costs = [given.merge] * len(tasks), [1.0] * len(tasks)
            requests += 10 * len(tasks)
        parts = min(given.parts, len(tasks), max(1, math.ceil(sum(costs) / (4e7 if number == 0 else 40))))
        stages.append((tasks, seconds, [time + given.start for time in in_parts(costs, seconds, parts)]))
    for source in plan["sources"]:
        about = source["description"]
        bytes_in += float(about.get("columns", 0)) * float(about.get("rows", 0)) * given.pixel_bytes
    requests += bytes_in / 1e6
    work = sum(sum(seconds) for _, seconds, _ in stages)
    publish = bytes_out / 1e6 / given.publish_mb
    longest = sum(max(seconds) for _, seconds, _ in stages) + publish
    print(f"{len(plan['sources'])} rasters; {len(stages[0][0])} blocks, {sum(len(t) for t, _, _ in stages[1:])} merges in {len(stages) - 1} stages")
    print(f"{work / 3600:.0f} core hours; longest path {longest / 3600:.2f} h, of it publish {publish / 3600:.2f} h")
    print(f"{bytes_in / 1e12:.2f} TB read, {bytes_out / 1e12:.2f} TB of shards written, as much read again by publish; {requests / 1e6:.1f} million requests")
    print("| nodes | hours | of it blocks | merges | publish | node hours | efficiency | storage, GB/s at the blocks |")
    print("|---|---|---|---|---|---|---|---|")
    for nodes in (int(word) for word in given.nodes.split(",")):
        cores = nodes * given.cores
        blocks, merges = span(stages[0][2], cores), sum(span(parts, cores) for _, _, parts in stages[1:])
        hours = (blocks + merges + publish) / 3600
        rate = (bytes_in + bytes_out) / blocks / 1e9
        print(f"| {nodes} | {hours:.2f} | {blocks / 3600:.2f} | {merges / 3600:.2f} | {publish / 3600:.2f} | {hours * nodes:.0f} | "
              f"{work / 3600 / (hours * cores):.0%} | {rate:.2f} |")


if __name__ == "__main__":
    main()
