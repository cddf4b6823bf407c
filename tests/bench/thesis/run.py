#!/usr/bin/env python3
"""Runs the experiments of the thesis' chapter 5 and those its section 6.2 asks for, and keeps the figures for report.py.

  run.py BUILD OUT.json [options]     BUILD: a build folder with bin/thesis_bench and, unless --input is given, bin/terrain_mesh

--real NAME=FILE,COLUMNS,ROWS,CELL_M   further terrains: float32 heights, rows from the south; as often as there are any
--only NAMES                           of the experiments below, separated by commas; whole, half an hour or more of one core, is run
                                       only where it is named: --only whole --add OLD.json keeps what is there"""
import argparse
import concurrent.futures
import json
import os
import platform
import re
import subprocess
import sys
import tempfile

TARGETS = [50000, 100000, 200000, 300000, 400000]
WINDOWS = [64, 128, 256, 512]
FAST = "repair=around shuffle=keyed come_back=1 order=test-first"
BEST = f"{FAST} window=65536 pool=0.6"


def published():
    """Tables 5.2 to 5.9, Figures 5.3 to 5.26."""
    return [f"window={w} collapses={t} pool=0.8 passes=1 each_window=1" for w in WINDOWS for t in TARGETS]


def listing():
    """The same by the listings: normals compared for equality, the neighbours without the -4."""
    return [f"{spec} inversion=normals c=10" for spec in published()]


def readings():
    """Algorithm 10 as listed is c = 10 of equation 4.1; pools; the race; what a phase takes."""
    return ([f"window=512 collapses={t} c=10 passes=1 pool=0.8 each_window=1" for t in TARGETS]
            + [f"window=512 collapses=400000 pool={p} passes=1" for p in (0.5, 0.6, 1)]
            + [f"window={w} collapses=400000 passes=1 lock=raced" for w in WINDOWS]
            + [f"window=512 collapses=400000 passes=1 seed={s}" for s in (2, 3)]
            + [f"window=512 collapses=400000 passes=1 lock=raced run={s}" for s in (1, 2)]
            + ["window=512 collapses=400000 passes=1 phases=1", "window=512 collapses=400000 passes=1 shuffle=none pool=0.8"])


def rearrange():
    """Table 5.7: one swap after the other, and the scan."""
    return [f"window=512 collapses={t} passes=1 rearrange={way}" for t in TARGETS for way in ("pointers", "scan")]


def faster():
    """Item 1, step by step."""
    ways = ["window=512", "window=512 repair=around", "window=512 repair=around shuffle=keyed", f"window=4096 {FAST}",
            f"window=65536 {FAST}", BEST, f"{BEST} selection=histogram", f"window=0 {FAST} pool=0.4"]
    return [f"{way} collapses=400000 repeat=5" for way in ways] + [f"{BEST} collapses={t} repeat=5" for t in TARGETS[:-1]]


def windows():
    """Item 2."""
    sizes = [512, 1024, 4096, 16384, 65536, 262144, 1048576]
    return ([f"window={w} {FAST} pool=0.6 collapses={{share}} repeat=2" for w in sizes]
            + [f"window={w} repair=around shuffle=keyed collapses={{share}} repeat=2" for w in sizes])


def metrics():
    """Item 3."""
    names = ("qem", "qem-best", "length", "melax", "angle", "vertical")
    return [f"metric={m} {BEST} collapses=400000" for m in names] + [f"metric={m} {BEST} triangles=199200" for m in names]


def selections():
    """Items 4, 5 and 7."""
    base = "repair=around collapses=400000"
    return [f"{base} window=512", f"{base} window=512 come_back=1", f"{base} window=65536", f"{base} window=65536 come_back=1",
            f"{base} window=65536 order=test-first", f"{base} window=65536 come_back=1 order=test-first",
            f"{base} window=512 shuffle=none", f"{base} window=512 shuffle=none come_back=1",
            f"{base} window=65536 shuffle=none come_back=1",
            f"{base} window=512 selection=unsorted", f"{base} window=65536 selection=unsorted come_back=1 shuffle=keyed",
            f"{base} window=65536 selection=histogram come_back=1 shuffle=keyed",
            f"{base} window=65536 selection=sort pool=0.3 come_back=1 shuffle=keyed",
            f"{base} window=0 selection=vertex-best", f"{base} window=0 selection=vertex-best come_back=1",
            f"{base} window=0 selection=super-independent pool=1", f"{base} window=0 selection=super-independent pool=0.6",
            f"{base} window=0 selection=super-independent pool=0.3", f"{base} window=0 selection=super-independent pool=0.3 shuffle=none",
            f"{base} window=65536 closing=1 shuffle=keyed", f"{base} window=65536 closing=1 selection=unsorted shuffle=keyed"]


def whole(stretches):
    """Table 5.2 at 50,000 as it was run, whole arrays repaired after every edge: the same collapses in so many stretches, each with its
    beginning done the quick way. Above, 300 collapses at each target; and some swaps of Table 5.7."""
    edges = [50000 * k // stretches for k in range(stretches + 1)]
    parts = [*zip(edges, edges[1:]), *((t, t + 300) for t in TARGETS)]
    return [[f"window=1 passes=1 pool=0.8 around_first={a} collapses={b} phases=1"] for a, b in parts] + [
        ["window=1 repair=around passes=1 pool=0.8 collapses=1000 rearrange=pointers"]]


def borders():
    """Item 6."""
    targets = ("collapses=400000", "triangles=199200", "triangles=19920")
    return [f"border={b} {BEST} {t}" for t in targets for b in ("keep", "collapse")]


def shapes():
    """Item 8."""
    return [f"{BEST} {t} {more}".strip() for t in ("collapses=400000", "triangles=199200")
            for more in ("", "delaunay=at-end", "delaunay=between pool=0.1", "pool=0.1", "taubin=3", "taubin=10")]


def rivals():
    """Item 10, ours; compare.py has the others."""
    return [f"strategy=waves quality={q} {t}" for t in ("triangles=1192008", "triangles=199200") for q in ("fast", "default")]


def terrains():
    """Item 9: everywhere the same."""
    return ["window=512 collapses=400000 passes=1 each_window=1", f"{BEST} collapses=400000", f"{BEST} triangles=199200",
            "strategy=waves quality=fast triangles=1192008", "strategy=waves quality=fast triangles=199200"]


ALL = {f.__name__: f for f in (published, readings, rearrange, faster, windows, metrics, selections, borders, shapes, rivals)}
JUDGED = {"readings", "metrics", "selections", "borders", "shapes", "rivals", "terrains", "faster"}


def shorter(row, most=200):
    """Collapses of each window as shares of it, at most so many means along the run; whole lists have tens of thousands."""
    windows, width = row.pop("windows", []), next((int(w[7:]) for w in row["spec"].split() if w.startswith("window=")), 0)
    if windows and width:
        edges = [len(windows) * k // most for k in range(most + 1)] if len(windows) > most else range(len(windows) + 1)
        parts = [windows[a:b] for a, b in zip(edges, edges[1:])]
        row["success_percent"] = [round(100 * sum(part) / (len(part) * width), 1) for part in parts]
    return row


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("out")
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--threads", default="1", help="of a CPU")
    parser.add_argument("--input", help="the mesh; else terrain_mesh 999 999")
    parser.add_argument("--side", type=int, default=999, help="of a smaller terrain_mesh, for a quick look: targets shrink with it")
    parser.add_argument("--real", action="append", default=[])
    parser.add_argument("--add", help="an earlier OUT.json: its rows are kept, but for those of experiments that are run again")
    parser.add_argument("--side-by-side", type=int, default=1, help="processes of whole at the same time")
    parser.add_argument("--only", default=",".join([*ALL, "sizes", "terrains", "listing", "sequential", "sample"]))
    return parser.parse_args()


class Runs:
    def __init__(self, options, work):
        self.options = options
        self.bin = os.path.join(options.build, "bin")
        self.input = options.input
        if not self.input:
            self.input = self.terrain(work, options.side)
        self.work = work
        self.rows = []

    def terrain(self, work, side):
        path = os.path.join(work, f"terrain_{side}.ply")
        if not os.path.exists(path):
            subprocess.run([os.path.join(self.bin, "terrain_mesh"), str(side), str(side), path], check=True)
        return path

    def scaled(self, spec):
        """Targets are counted for 998,001 vertices."""
        share = (self.options.side / 999) ** 2
        return re.sub(r"\b(collapses|triangles|around_first)=(\d+)", lambda found: f"{found[1]}={round(int(found[2]) * share)}", spec)

    def run(self, experiment, specs, source=None, terrain="made", device=None):
        command = [os.path.join(self.bin, "thesis_bench"), "--device", device or self.options.device]
        command += ["--threads", self.options.threads]
        command += source or ["--input", self.input]
        command += ["--judge"] if experiment in JUDGED else []
        done = subprocess.run(command + [self.scaled(spec) for spec in specs], capture_output=True, text=True)
        if done.returncode != 0:
            print(f"{experiment} {terrain}: {done.stderr.strip()}", file=sys.stderr, flush=True)
            return
        for spec, row in zip(specs, json.loads(done.stdout)):
            self.rows.append(dict(shorter(row), spec=spec, experiment=experiment, terrain=terrain))
        print(experiment, terrain, len(specs), "runs", flush=True)


def main():
    options = arguments()
    wanted = options.only.split(",")
    with tempfile.TemporaryDirectory() as work:
        runs = Runs(options, work)
        for name in wanted:
            if name in ALL:
                runs.run(name, [spec.replace("{share}", "400000") for spec in ALL[name]()])
        for side in (250, 500, 2000) if "sizes" in wanted and options.side == 999 else ():
            share = str(int(side * side * 0.4))
            specs = [spec.replace("{share}", share) for spec in windows()]
            runs.run("windows", specs, ["--input", runs.terrain(work, side)], f"made {side}")
        for real in options.real if "terrains" in wanted else ():
            name, place = real.split("=")
            runs.run("terrains", terrains(), ["--raw", *place.split(",")], name)
        for real in options.real if "listing" in wanted else ():
            name, place = real.split("=")
            source = ["--raw", *place.split(",")]
            runs.run("listing", listing(), source, name)
            alone = "window=1 repair=around passes=1 inversion=normals c=10 pool=0.8"
            runs.run("listing", [f"{alone} collapses={t}" for t in TARGETS], source, name, "cpu")
        if "terrains" in wanted:
            runs.run("terrains", terrains())
        if "sequential" in wanted:
            runs.run("sequential", [f"window=1 repair=around passes=1 collapses={t}" for t in TARGETS], device="cpu")
        if "whole" in wanted:
            with concurrent.futures.ThreadPoolExecutor(options.side_by_side) as pool:
                list(pool.map(lambda specs: runs.run("whole", specs, device="cpu"), whole(options.side_by_side)))
        if "sample" in wanted:
            runs.run("sample", ["window=1 passes=1 collapses=300 phases=1", "window=1 passes=1 collapses=100 rearrange=pointers"],
                     device="cpu")
        kept = json.load(open(options.add, encoding="utf-8"))["rows"] if options.add else []
        rows = [row for row in kept if row["experiment"] not in wanted] + runs.rows
        with open(options.out, "w", encoding="utf-8") as file:
            json.dump({"machine": platform.processor() or platform.machine(), "cores": os.cpu_count(), "rows": rows}, file)


if __name__ == "__main__":
    main()
