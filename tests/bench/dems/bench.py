#!/usr/bin/env python3
"""Builds real elevation models and measures what came out, from the bytes of the tiles.

  bench.py BUILD [FOLDER] [--dem FILE]... [--only NAME]... [--smallest N] [--threads N] [--samples N] [--json FILE] [--write]
           [-- OPTION...]

BUILD holds bin/cordillera and bin/remeasure. Every elevation model of FOLDER is built, and every --dem; what follows -- goes to each
build. Prints the tables as Markdown. --write puts them into README.md and levels.md beside this file. Python's own library is enough."""
import argparse
import datetime
import fnmatch
import json
import os
import platform
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import tables

HERE = os.path.dirname(os.path.abspath(__file__))
RASTERS = (".tif", ".tiff", ".hgt", ".dem", ".asc")


def arguments():
    words, extra = sys.argv[1:], []
    if "--" in words:
        words, extra = words[: words.index("--")], words[words.index("--") + 1 :]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", help="build folder")
    parser.add_argument("folder", nargs="?", help="folder of elevation models; a folder geoid/ in it is used for their grids")
    parser.add_argument("--dem", action="append", default=[], metavar="FILE", help="one more elevation model")
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="only files of this name; * stands for anything")
    parser.add_argument("--smallest", type=int, metavar="N", help="only the N smallest files")
    parser.add_argument("--threads", type=int, default=0, metavar="N", help="of the builds; 0: one for each usable core")
    parser.add_argument("--samples", type=float, default=2e6, metavar="N", help="measured a level and file, at most; 0: all")
    parser.add_argument("--json", metavar="FILE", help="the figures as JSON")
    parser.add_argument("--write", action="store_true", help="put the tables into README.md and levels.md")
    return parser.parse_args(words), extra


def elevation_models(args):
    files = []
    if args.folder:
        names = sorted(name for name in os.listdir(args.folder) if name.lower().endswith(RASTERS))
        files = [os.path.join(args.folder, name) for name in names]
    files += args.dem
    if args.only:
        files = [file for file in files if any(fnmatch.fnmatch(os.path.basename(file), only) for only in args.only)]
    if args.smallest:
        files = sorted(files, key=os.path.getsize)[: args.smallest]
    if not files:
        sys.exit("no elevation model: name a folder that holds some, or --dem FILE")
    return files


def timed(command, environment):
    """Runs a command; its resources are those of the process alone, so it gets no shell around it."""
    start = time.monotonic()
    with tempfile.TemporaryFile() as words:
        to_words = [(os.POSIX_SPAWN_DUP2, words.fileno(), 1), (os.POSIX_SPAWN_DUP2, words.fileno(), 2)]
        process = os.posix_spawn(command[0], command, environment, file_actions=to_words)
        try:
            _, status, used = os.wait4(process, 0)
        except BaseException:  # the bench is being stopped, and so the build
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            raise
        words.seek(0)
        if os.waitstatus_to_exitcode(status) != 0:
            raise RuntimeError(f"{shlex.join(command)}: {words.read().decode(errors='replace').strip()}")
    return {"wall_s": time.monotonic() - start, "cpu_s": used.ru_utime + used.ru_stime, "peak_bytes": used.ru_maxrss * 1024}


def measured_dem(file, args, extra, environment, work):
    out = os.path.join(work, "out")
    command = [os.path.join(args.build, "bin", "cordillera"), "build", file, "-o", out, "--threads", str(args.threads)]
    config = os.path.join(HERE, "options", os.path.splitext(os.path.basename(file))[0] + ".conf")
    if os.path.exists(config):
        command += ["--config", config]
    used = timed(command + extra, environment)
    with open(os.path.join(out, "manifest.json"), encoding="utf-8") as text:
        manifest = json.load(text)
    threads = str(os.cpu_count() or 1)
    seen = json.loads(subprocess.run([os.path.join(args.build, "bin", "remeasure"), file, out, str(args.samples), threads],
                                     env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout)
    shutil.rmtree(out)
    return figures(file, manifest, seen, used, args.threads or os.cpu_count())


def figures(file, manifest, seen, used, threads):
    """What a dataset states beside what was measured; tiles and triangles are counted anew, and must be those of the manifest."""
    levels = []
    for stated, measured in zip(manifest["levels"], seen["levels"]):
        for name in ("level", "tiles", "triangles", "drc_bytes", "glb_bytes"):
            if stated[name] != measured[name]:
                raise RuntimeError(f"{file}: the manifest states {name} = {stated[name]}, its files have {measured[name]}")
        levels.append({**measured, "target_m": stated["target"], "stated_max_m": stated["stated_max_error"], "stated_rmse_m": stated.get("rmse"),
                       "composed": stated["composed"]})
    if len(levels) != len(manifest["levels"]) or len(levels) != len(seen["levels"]):
        raise RuntimeError(f"{file}: {len(manifest['levels'])} levels are stated, {len(seen['levels'])} have tiles")
    source = manifest["source"]
    return {"file": os.path.basename(file), "columns": source["columns"], "rows": source["rows"], "vertical_datum": source["vertical_datum"],
            "error_at_pixels_m": source["error_at_pixels"]["max"], "cell_m": manifest["cell_m"], "lattice_samples": seen["lattice_samples"],
            "device": manifest["device"], "threads": threads, **used, "levels": levels}


def output_of(command):
    try:
        return subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def setting(args, extra):
    """Where and when: a number without it means nothing."""
    with open("/proc/cpuinfo", encoding="utf-8") as text:
        cpu = next((line.split(":", 1)[1].strip() for line in text if line.startswith("model name")), platform.processor())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    changed = "" if output_of(["git", "status", "--porcelain", "--", "../../..", ":!."]) == "" else ", changed"
    words = ["bench.py", "BUILD"] + (["FOLDER"] if args.folder else []) + [f"--dem {os.path.basename(dem)}" for dem in args.dem]
    words += [f"--only '{only}'" for only in args.only] + ([f"--smallest {args.smallest}"] if args.smallest else [])
    words += [f"--threads {args.threads}"] if args.threads else []
    words += [f"--samples {args.samples:.0f}"] + (["--"] + extra if extra else [])
    return {"date": datetime.date.today().isoformat(), "cpu": cpu, "cores": os.cpu_count(), "memory_bytes": memory,
            "commit": output_of(["git", "rev-parse", "--short", "HEAD"]) + changed, "command": " ".join(words)}


def main():
    args, extra = arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("stopped"))
    environment = dict(os.environ)
    geoids = os.path.join(args.folder or "", "geoid")
    if os.path.isdir(geoids):
        environment["CORDILLERA_GEOIDS"] = os.pathsep.join(filter(None, [os.path.abspath(geoids), environment.get("CORDILLERA_GEOIDS")]))
    result, failed = {"setting": setting(args, extra), "dems": []}, 0
    for file in elevation_models(args):
        print(f"{os.path.basename(file)} ...", end=" ", file=sys.stderr, flush=True)
        try:
            with tempfile.TemporaryDirectory() as work:
                dem = measured_dem(file, args, extra, environment, work)
        except (RuntimeError, subprocess.CalledProcessError) as error:
            print(f"FAILED: {error}", file=sys.stderr)
            failed += 1
            continue
        print(f"{dem['wall_s']:.1f} s, {dem['peak_bytes'] / 2**20:.0f} MiB, {'holds' if tables.holds(dem) else 'UNTRUE'}", file=sys.stderr)
        result["dems"].append(dem)
    if args.json:
        with open(args.json, "w", encoding="utf-8") as text:
            json.dump(result, text, indent=1)
    if args.write:
        tables.write(result, HERE)
    print(tables.summary(result))
    print(tables.by_level(result))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
