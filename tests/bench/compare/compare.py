#!/usr/bin/env python3
"""Simplifies one mesh with every simplifier that is there, and has one judge measure all results.

  compare.py BUILD [options]     BUILD: a build with -DCORDILLERA_COMPARE=ON; README.md beside this file says how to make one

Prints a table; --json FILE keeps the figures, for plot.py."""
import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
# Name in the table, program, variant.
RIVALS = [
    ("CGAL Lindstrom-Turk", "rival_cgal", "lindstrom-turk"),
    ("CGAL Garland-Heckbert", "rival_cgal", "garland-heckbert"),
    ("OpenMesh quadrics", "rival_openmesh", ""),
    ("VTK quadrics", "rival_vtk", ""),
    ("meshoptimizer", "rival_meshoptimizer", ""),
    ("Fast-Quadric", "rival_fqms", ""),
    ("hmm", "rival_hmm", ""),
]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", help="build folder")
    parser.add_argument("--input", help="a mesh (.ply, .off, .obj); else one is made by terrain_mesh")
    parser.add_argument("--between", help="the same surface at more places than the input has, to be measured there too; made with the input")
    parser.add_argument("--size", type=int, default=999, help="vertices along a side of the made terrain")
    parser.add_argument("--seed", type=int, default=1, help="of the made terrain")
    parser.add_argument("--targets", default="1192008,199200,19920", help="triangles, separated by commas")
    parser.add_argument("--only", default="", help="names that begin so, separated by commas")
    parser.add_argument("--cordillera", help="the program; else BUILD/bin/cordillera")
    parser.add_argument("--qualities", default="fast,default,best,minimax", help="of ours")
    parser.add_argument("--device", default="cpu", help="of ours")
    parser.add_argument("--wasm", help="folder of the npm package meshoptimizer, run with node")
    parser.add_argument("--limit", type=int, default=1800, help="seconds a run may take")
    parser.add_argument("--json", help="file for the figures")
    return parser.parse_args()


def call(command, limit):
    """The JSON that it prints, or what went wrong. Some libraries print lines of their own before."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return None, f"longer than {limit} s"
    if done.returncode != 0:
        return None, (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
    return json.loads(done.stdout[done.stdout.index("{"):]), ""


class Comparison:
    def __init__(self, options, work):
        self.options = options
        self.bin = os.path.join(options.build, "bin")
        self.out = os.path.join(work, "out.ply")
        self.input = options.input or self.terrain(os.path.join(work, "in.ply"), 1)
        self.between = options.between or ("" if options.input else self.terrain(os.path.join(work, "between.ply"), 2))

    def program(self, name):
        return os.path.join(self.bin, name)

    def terrain(self, path, finer):
        side = finer * (self.options.size - 1) + 1
        subprocess.run([self.program("terrain_mesh"), str(side), str(side), path, str(30 / finer), str(self.options.seed)], check=True)
        return path

    def simplifiers(self):
        """(name, target -> command)"""
        wanted = [name for name in self.options.only.split(",") if name]
        found = []
        for name, program, variant in RIVALS:
            if os.path.exists(self.program(program)):
                found.append((name, lambda n, p=program, v=variant: [self.program(p), self.input, self.out, str(n)] + ([v] if v else [])))
        if self.options.wasm:
            script = os.path.join(HERE, "meshoptimizer_wasm.mjs")
            found.append(("meshoptimizer (WASM)", lambda n: ["node", script, self.input, self.out, str(n), self.options.wasm]))
        ours = self.options.cordillera or self.program("cordillera")
        if os.path.exists(ours):
            for quality in self.options.qualities.split(","):
                found.append((f"Cordillera {quality}", lambda n, q=quality: [
                    ours, "simplify", self.input, "-o", self.out, "--triangles", str(n), "--quality", q, "--device", self.options.device, "--json"]))
        return [(name, command) for name, command in found if not wanted or any(name.startswith(begin) for begin in wanted)]

    def measured(self, name, command, target):
        if os.path.exists(self.out):
            os.remove(self.out)
        report, wrong = call(command(target), self.options.limit)
        row = {"name": name, "target": target}
        if report is None:
            return dict(row, failed=wrong)
        row["seconds"] = report["simplify_seconds"]
        row["cpu_seconds"] = report["simplify_cpu_seconds"]
        row["device"] = report.get("device", "cpu")
        error, wrong = call([self.program("mesh_error"), self.input, self.out], self.options.limit)
        if error is None:
            return dict(row, failed=wrong)
        row.update(error)
        if self.between:
            between, _ = call([self.program("mesh_error"), self.between, self.out], self.options.limit)
            if between:
                row.update(rmse_between_m=between["rmse_m"], max_between_m=between["max_error_m"])
        return row


def machine():
    """What figures depend on."""
    model = ""
    if os.path.exists("/proc/cpuinfo"):
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "")
    return {"cpu": model or platform.processor(), "cores": os.cpu_count(), "system": platform.system() + " " + platform.machine()}


TITLES = f"{'':24}{'triangles':>10}{'seconds':>9}{'CPU s':>8}{'rmse m':>9}{'max m':>8}{'between':>9}{'max':>7}{'flipped':>8}{'uncovered':>10}{'crowded':>8}{'valence':>8}"


def line(row):
    if "failed" in row:
        return f"{row['name']:24}{row['target']:10}  {row['failed']}"
    between = f"{row['rmse_between_m']:9.3f}{row['max_between_m']:7.1f}" if "rmse_between_m" in row else f"{'-':>9}{'-':>7}"
    return (f"{row['name']:24}{row['triangles']:10}{row['seconds']:9.2f}{row['cpu_seconds']:8.2f}{row['rmse_m']:9.4f}{row['max_error_m']:8.2f}{between}"
            f"{row['flipped']:8}{row['uncovered']:10}{row['crowded_edges']:8}{row['max_valence']:8}")


def main():
    options = arguments()
    targets = [int(target) for target in options.targets.split(",")]
    with tempfile.TemporaryDirectory() as work:
        comparison = Comparison(options, work)
        simplifiers = comparison.simplifiers()
        if not simplifiers:
            sys.exit(f"{options.build}/bin holds no simplifier to compare")
        rows = []
        print(TITLES)
        for target in targets:
            for name, command in simplifiers:
                rows.append(comparison.measured(name, command, target))
                print(line(rows[-1]), flush=True)
            print()
    if options.json:
        terrain = options.input or f"terrain_mesh {options.size} {options.size}, seed {options.seed}"
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"machine": machine(), "input": os.path.basename(terrain), "rows": rows}, file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    main()
