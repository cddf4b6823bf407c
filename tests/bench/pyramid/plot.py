#!/usr/bin/env python3
"""Draws what pyramid_bench --json printed: time against size, and what the time goes into.

  plot.py FOLDER FIGURES.json...    writes size.svg and passes.svg into FOLDER; needs gnuplot. A file a size: the finest level counts."""
import json
import os
import subprocess
import sys

HEAD = "set terminal svg size 900,600 font 'sans,14' background '#ffffff'\nset grid\nset key outside right noenhanced\n"


def finest(path):
    with open(path, encoding="utf-8") as file:
        return max(json.load(file), key=lambda row: row["level"])


def on_device(row):
    return sum(ms for name, ms in row["stages_ms"].items() if name.startswith("pass "))


def size_script(rows):
    data = "\n".join(f"{row['vertices_in']} {on_device(row)} {1e3 * row['simplify_seconds']}" for row in rows)
    return (f"$d << END\n{data}\nEND\n{HEAD}set output 'size.svg'\nset title 'Time against size'\nset logscale xy\n"
            "set xlabel 'vertices of the finest level'\nset ylabel 'ms'\nset format x '10^{%T}'\n"
            "plot $d using 1:2 with linespoints lw 3 title 'passes on the device', $d using 1:3 with linespoints lw 2 title 'the whole call', "
            "x / 1e6 with lines dt 2 title '1 Gvertex/s'\n")


def passes_script(rows):
    stages = list(dict.fromkeys(name for row in rows for name in row["stages_ms"]))
    lines = ["size " + " ".join(f'"{name}"' for name in stages)]
    for row in rows:
        million = row["vertices_in"] / 1e6
        lines.append(f"{million:.3g} " + " ".join(f"{row['stages_ms'].get(name, 0) / million:.4f}" for name in stages))
    data = "\n".join(lines)
    return (f"$d << END\n{data}\nEND\n{HEAD}set output 'passes.svg'\nset title 'What a million vertices take'\nset style data histograms\n"
            "set style histogram rowstacked\nset style fill solid 0.8\nset boxwidth 0.7\nset yrange [0:*]\n"
            "set xlabel 'millions of vertices in a call'\nset ylabel 'ms for a million'\n"
            f"plot for [k=2:{len(stages) + 1}] $d using k:xtic(1) title columnheader(k)\n")


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    rows = sorted((finest(path) for path in sys.argv[2:]), key=lambda row: row["vertices_in"])
    os.makedirs(sys.argv[1], exist_ok=True)
    for script in (size_script(rows), passes_script(rows)):
        subprocess.run(["gnuplot"], input=script, text=True, check=True, cwd=sys.argv[1])


if __name__ == "__main__":
    main()
