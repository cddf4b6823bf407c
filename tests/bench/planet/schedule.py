#!/usr/bin/env python3
"""How long a plan takes on so many nodes: list scheduling of its tasks, stage after stage, as submit.sh hands them to Slurm.

  tests/bench/planet/schedule.py PLAN --times TIMES.json [options]    PLAN: a folder that `cordillera plan` wrote; TIMES.json: see measure.py

Each task takes what a measured one took, chosen by its key and scaled by the share of it that rasters cover, so the same plan gives the same
table. What is simulated: cores that take the parts of an array in order, no faster than the controller starts them (--starts), a start
of each part (--start: the program, and reading of the plan), a barrier between stages (--barrier), publish by one core at the end. What
is not: a queue of others, lost nodes, a storage that is slower than what is needed."""
import argparse
import heapq
import os

import tasks


def words():
    given = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    given.add_argument("plan")
    given.add_argument("--times", required=True, help="what measure.py wrote")
    given.add_argument("--nodes", default="16,64,256")
    given.add_argument("--cores", type=int, default=32, help="of a node [32]")
    given.add_argument("--start", type=float, default=1.0, help="core seconds before a part begins to work [1]")
    given.add_argument("--starts", type=float, default=50, help="parts that the controller starts a second [50]")
    given.add_argument("--barrier", type=float, default=3, help="seconds from a stage's end to the next one's start [3]")
    given.add_argument("--parts", type=int, default=1000, help="of an array, as for submit.sh [1000]")
    given.add_argument("--samples", type=float, default=4e7, help="that a part should get at least, as for submit.sh [40000000]")
    given.add_argument("--pixel-bytes", type=float, default=2.7, help="of a source pixel as it is stored [2.7]")
    given.add_argument("--requests", default="3,5", help="of a raster that a block reads, and for each MB that it reads [3,5]")
    given.add_argument("--sleeps", metavar="FOLDER", help="write the seconds of each part, for emulate.sh, and no table")
    return given.parse_args()


def span(times, workers, starts):
    """When the last of the parts ends, if a free core takes the next and the controller starts so many a second."""
    free, end = [0.0] * min(workers, len(times)), 0.0
    for k, time in enumerate(times):
        begin = max(free[0], k / starts)
        heapq.heapreplace(free, begin + time)
        end = max(end, begin + time)
    return end


def pixels_read(plan):
    """Of all blocks: a raster's share of the blocks it lies in is read by each of them, a rim more or less."""
    return sum(float(source["description"].get("columns", 0)) * float(source["description"].get("rows", 0)) for source in plan["sources"])


class Work:
    """A plan with the times of its tasks and parts."""

    def __init__(self, plan, times, given):
        self.plan, self.stages, self.parts = plan, times.stages(plan), []
        for stage, taken in zip(plan["stages"], self.stages):
            costs = [tasks.cost(task) for task in stage["tasks"]]
            parts = tasks.parts_of(costs, given.samples, given.parts)
            self.parts.append([time + given.start for time in tasks.in_parts(costs, [seconds for seconds, _ in taken], parts)])
        self.core_seconds = [sum(seconds for seconds, _ in stage) for stage in self.stages]
        self.shard_bytes = sum(size for stage in self.stages for _, size in stage)
        self.bytes_in = pixels_read(plan) * given.pixel_bytes
        self.publish = self.shard_bytes * times.publish["seconds"] / times.publish["shard_bytes"]
        self.store_bytes = self.shard_bytes * times.publish["bytes"] / times.publish["shard_bytes"]
        a_raster, a_mb = (float(word) for word in given.requests.split(","))
        rasters = sum(len(task["sources"]) for task in plan["stages"][0]["tasks"])
        merges = sum(len(stage) for stage in self.stages[1:])
        # A task asks whether its shard is there and writes it; publish asks for and reads each; a merge reads four.
        self.requests = a_raster * rasters + a_mb * self.bytes_in / 1e6 + 4 * (len(self.stages[0]) + merges) + 4 * merges
        self.longest = sum(max(seconds for seconds, _ in stage) + given.start + given.barrier for stage in self.stages) + self.publish


def tell(work, given):
    blocks, merges = work.core_seconds[0], sum(work.core_seconds[1:])
    print(f"{len(work.plan['sources'])} rasters; {len(work.stages[0])} blocks in {len(work.parts[0])} parts, "
          f"{sum(map(len, work.stages[1:]))} merges in {len(work.stages) - 1} stages")
    print(f"{(blocks + merges + work.publish) / 3600:.0f} core hours: blocks {blocks / 3600:.1f}, merges {merges / 3600:.1f}, publish {work.publish / 3600:.1f}")
    print(f"longest path, with as many cores as tasks: {work.longest / 3600:.2f} h, without publish {(work.longest - work.publish) / 60:.1f} min")
    print(f"{work.bytes_in / 1e12:.2f} TB of rasters read, {work.shard_bytes / 1e12:.2f} TB of shards written and read again, "
          f"{work.store_bytes / 1e12:.2f} TB published; {work.requests / 1e6:.1f} million requests")
    print("| nodes | cores | blocks, min | merges, min | tasks, h | with publish, h | node hours | efficiency of the tasks | storage during blocks, GB/s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for nodes in (int(word) for word in given.nodes.split(",")):
        cores = nodes * given.cores
        first = span(work.parts[0], cores, given.starts) + given.barrier
        rest = sum(span(parts, cores, given.starts) + given.barrier for parts in work.parts[1:])
        all_tasks = first + rest
        rate = (work.bytes_in + sum(size for _, size in work.stages[0])) / first / 1e9
        # Publish is one core of one node; the others are free by then.
        print(f"| {nodes} | {cores} | {first / 60:.1f} | {rest / 60:.1f} | {all_tasks / 3600:.2f} | {(all_tasks + work.publish) / 3600:.2f} | "
              f"{(all_tasks * nodes + work.publish) / 3600:.0f} | {(blocks + merges) / (all_tasks * cores):.0%} | {rate:.2f} |")


def write_sleeps(work, folder):
    for stage, parts in enumerate(work.parts):
        with open(os.path.join(folder, f"stage-{stage}-of-{len(parts)}"), "w", encoding="utf-8") as file:
            file.writelines(f"{time:.3f}\n" for time in parts)


def main():
    given = words()
    work = Work(tasks.read_plan(given.plan), tasks.Times(given.times), given)
    if given.sleeps:
        write_sleeps(work, given.sleeps)
    else:
        tell(work, given)


if __name__ == "__main__":
    main()
