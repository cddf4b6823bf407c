#!/usr/bin/env python3
"""Does the tasks of a plan one at a time, on one thread each, and writes what each took: measure.py PLAN TIMES.json [--program FILE]

Times are processor seconds, user and system, so that a busy machine matters less; start of the program and reading of the plan included.
`schedule.py` and `emulate.sh` take TIMES.json. The plan's shards must not be there yet: what is done is not done again."""
import argparse
import json
import os
import resource
import subprocess
import time

import tasks


def measured(words):
    """Processor seconds, seconds on the clock, and most memory in MB of all children so far."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return round(seconds, 2), round(time.monotonic() - start, 2), round(after.ru_maxrss / 1024)


def main():
    given = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    given.add_argument("plan")
    given.add_argument("times")
    given.add_argument("--program", default="cordillera")
    given = given.parse_args()
    plan = tasks.read_plan(given.plan)
    shares = tasks.covered(plan)
    out = {"blocks": [], "merges": [], "publish": {}}
    for number, stage in enumerate(plan["stages"]):
        joined = tasks.children(plan, number) if number else []
        for k, task in enumerate(stage["tasks"]):
            seconds, _, memory = measured([given.program, "work", given.plan, "--stage", str(number), "--task", str(k), "--threads", "1",
                                           "--device", "cpu", "-q"])
            shard = os.path.join(given.plan, "shards", task["key"][:2], task["key"] + ".shard")
            row = {"stage": number, "task": k, "seconds": seconds, "memory_mb": memory, "bytes": os.path.getsize(shard)}
            if number:
                row["children"] = joined[k]
            else:
                row |= {"share": round(shares[k], 3), "samples": round(tasks.samples_of(plan, shares[k]))}
            out["merges" if number else "blocks"].append(row)
            print(row, flush=True)
    store = os.path.join(given.plan, "measured.sqlite")
    seconds, clock, memory = measured([given.program, "publish", given.plan, "-o", store, "-q", "--overwrite"])
    taken = sum(row["bytes"] for row in out["blocks"] + out["merges"])
    out["publish"] = {"seconds": seconds, "clock_seconds": clock, "memory_mb": memory, "shard_bytes": taken, "bytes": os.path.getsize(store),
                      "tasks": len(out["blocks"]) + len(out["merges"])}
    os.remove(store)
    with open(given.times, "w", encoding="utf-8") as file:
        json.dump(out, file, indent=1)


if __name__ == "__main__":
    main()
