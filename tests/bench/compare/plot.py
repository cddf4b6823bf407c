#!/usr/bin/env python3
"""Draws what compare.py kept: error against triangles, and against seconds, a line for each simplifier.

  plot.py FIGURES.json FOLDER    writes rmse.svg, max.svg, between.svg and time.svg there; needs gnuplot"""
import json
import os
import subprocess
import sys

PLOTS = [
    # File, title, x, its label, y, its label.
    ("rmse.svg", "RMSE at the samples", "triangles", "triangles", "rmse_m", "RMSE, m"),
    ("max.svg", "Greatest error at the samples", "triangles", "triangles", "max_error_m", "greatest error, m"),
    ("between.svg", "RMSE between the samples", "triangles", "triangles", "rmse_between_m", "RMSE, m"),
    ("time.svg", "Time and error", "cpu_seconds", "CPU seconds", "rmse_m", "RMSE, m"),
]


def names(rows):
    """In the order of the file; ours last, to lie on top."""
    seen = list(dict.fromkeys(row["name"] for row in rows))
    return [n for n in seen if not n.startswith("Cordillera")] + [n for n in seen if n.startswith("Cordillera")]


def block(rows, name, x, y):
    """The points of one simplifier as gnuplot's data block; None if there is none."""
    points = [(row[x], row[y]) for row in rows if row["name"] == name and row.get(x, 0) > 0 and row.get(y, 0) > 0]
    return "\n".join(f"{a} {b}" for a, b in points) if points else None


def script(rows, plot):
    path, title, x, x_label, y, y_label = plot
    blocks = {name: block(rows, name, x, y) for name in names(rows)}
    drawn = [(name, data) for name, data in blocks.items() if data]
    if not drawn:
        return None
    lines = [f"$d{k} << END\n{data}\nEND" for k, (_, data) in enumerate(drawn)]
    lines += ["set terminal svg size 900,600 font 'sans,14' background '#ffffff'", f"set output '{path}'", f"set title '{title}'",
              f"set xlabel '{x_label}'", f"set ylabel '{y_label}'", "set logscale xy", "set grid", "set key outside right noenhanced",
              "set format x '10^{%T}'"]
    curves = []
    for k, (name, _) in enumerate(drawn):
        width = 3 if name.startswith("Cordillera") else 1.5
        curves.append(f"$d{k} using 1:2 with linespoints lw {width} pt {k + 1} title '{name}'")
    return "\n".join(lines + ["plot " + ", \\\n  ".join(curves)]) + "\n"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = [row for row in json.load(file)["rows"] if "failed" not in row]
    os.makedirs(sys.argv[2], exist_ok=True)
    for plot in PLOTS:
        text = script(rows, plot)
        if text:
            subprocess.run(["gnuplot"], input=text, text=True, check=True, cwd=sys.argv[2])


if __name__ == "__main__":
    main()
