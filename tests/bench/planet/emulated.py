#!/usr/bin/env python3
"""What a run of emulate.sh tells: a row of a table, from the log of its tasks (stage, part, when it began and ended, how long it slept)."""
import argparse

from schedule import span

WINDOW = 10.0  # seconds, over which starts are counted


def fastest(begins):
    """Most starts a second over WINDOW, or over all of them where that is shorter."""
    begins, most, first = sorted(begins), 0, 0
    for last, begin in enumerate(begins):
        while begin - begins[first] > WINDOW:
            first += 1
        most = max(most, last - first + 1)
    return most / min(WINDOW, max(1.0, begins[-1] - begins[0]))


def main():
    given = argparse.ArgumentParser()
    given.add_argument("ran")
    for name in ("nodes", "cores"):
        given.add_argument("--" + name, type=int)
    for name in ("scale", "began", "submitted"):
        given.add_argument("--" + name, type=float)
    given = given.parse_args()
    with open(given.ran, encoding="utf-8") as file:
        rows = [line.split() for line in file]
    stages = {}
    for stage, part, begin, end, slept in (row for row in rows if row[0] != "publish"):
        stages.setdefault(int(stage), []).append((int(part), float(begin), float(end), float(slept)))
    slots = given.nodes * given.cores
    done = max(end for parts in stages.values() for _, _, end, _ in parts)
    blocks = max(end for _, _, end, _ in stages[0]) - given.began
    slept = sum(one for parts in stages.values() for *_, one in parts)
    ideal = sum(span([one for *_, one in sorted(parts)], slots, 1e9) for parts in stages.values())
    ordered = sorted(stages)
    gaps = [min(b for _, b, _, _ in stages[above]) - max(e for _, _, e, _ in stages[below]) for below, above in zip(ordered, ordered[1:])]
    first = min(begin for _, begin, _, _ in stages[0]) - given.began
    everything = done - given.began
    print("| nodes | cores | jobs | 1 s stands for | submitted in, s | first start, s | starts a second, most | blocks, s | all tasks, s | without a scheduler, s | "
          "mean gap between stages, s | efficiency |\n|---|---|---|---|---|---|---|---|---|---|---|---|")
    print(f"| {given.nodes} | {slots} | {sum(map(len, stages.values()))} | {given.scale:.1f} | {given.submitted - given.began:.1f} | {first:.1f} | "
          f"{fastest([b for parts in stages.values() for _, b, _, _ in parts]):.0f} | {blocks:.0f} | {everything:.0f} | {ideal:.0f} | "
          f"{sum(gaps) / max(1, len(gaps)):.1f} | {slept / slots / everything:.0%} |")


if __name__ == "__main__":
    main()
