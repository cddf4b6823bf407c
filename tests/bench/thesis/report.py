#!/usr/bin/env python3
"""Renders what run.py kept: tables.md, report.html and plots (SVG, by gnuplot) into a folder, the published figures beside ours.

  report.py FIGURES.json FOLDER"""
import html
import json
import os
import re
import subprocess
import sys

TARGETS = [50000, 100000, 200000, 300000, 400000]
WINDOWS = [64, 128, 256, 512]
# Tables 5.2 to 5.7 of the thesis: iterations, seconds.
PUBLISHED = {
    1: [(93345, 8152), (199360, 16370), (450673, 33276), (754361, 50780), (1110420, 68894)],
    64: [(1645, 15.20), (3777, 36.27), (9461, 89.54), (16860, 174.44), (26828, 263.27)],
    128: [(820, 7.88), (1904, 19.13), (4747, 47.27), (8464, 86.32), (13429, 129.85)],
    256: [(410, 4.19), (948, 8.60), (2374, 23.41), (4221, 43.35), (6727, 64.66)],
    512: [(207, 1.85), (478, 4.34), (1189, 11.79), (2121, 18.87), (3367, 33.19)],
}
PUBLISHED_REARRANGE = {"sequential": [1002, 1908, 3440, 4597, 5398], "parallel": [125, 253, 466, 616, 744]}


def word(row, name, otherwise=None):
    found = re.search(rf"\b{name}=(\S+)", row["spec"])
    return found.group(1) if found else otherwise


class Figures:
    def __init__(self, rows):
        self.rows = rows

    def of(self, experiment, terrain="made"):
        return [row for row in self.rows if row["experiment"] == experiment and row["terrain"] == terrain]

    def table(self, experiment, terrain="made"):
        """(window, target) -> row"""
        return {(int(word(r, "window")), int(word(r, "collapses"))): r for r in self.of(experiment, terrain)}


def seconds(value):
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def table(title, head, rows):
    lines = [f"**{title}**", "", "| " + " | ".join(head) + " |", "|" + "|".join(["---"] + ["--:"] * (len(head) - 1)) + "|"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


class AsPublished:
    """One edge after the other, repairs over whole arrays for each, a pass over all arrays for each swap. Measured whole at 50,000
    collapses, in stretches (run.py --only whole); above, by the seconds an edge of samples at each target; swaps by a sample."""

    def __init__(self, figures):
        self.alone = {int(word(r, "collapses")): r for r in figures.of("sequential")}
        rows = figures.of("whole") or figures.of("sample")
        swaps = next(r for r in rows if word(r, "rearrange"))
        self.per_swap = swaps["rearrange_seconds"] / self.swaps(swaps)
        parts = {int(word(r, "around_first", 0)): r for r in rows if not word(r, "rearrange")}
        self.samples = {first: row for first, row in parts.items() if first in TARGETS}
        stretches = [row for first, row in sorted(parts.items()) if first not in TARGETS]
        self.tried = stretches[-1]["tried"]
        self.seconds = sum(map(self.repairs, stretches))
        self.measured = {TARGETS[0]} if stretches[-1]["collapses"] == TARGETS[0] else set()

    @staticmethod
    def repairs(row):
        if not row["phases"]:  # of all processor time the part that the collapses had of the time on the clock
            return row["cpu_seconds"] * row["collapse_seconds"] / row["seconds"]
        return sum(row["phases"].get(name, 0) for name in ("triangle repair", "edge repair", "connectivity repair"))

    @staticmethod
    def swaps(row):
        """Gaps lie anywhere, for the pool was shuffled: of n + c places, c of them gaps, those among the first n."""
        return row["collapses"] * row["vertices"] / (row["vertices"] + row["collapses"])

    def per_try(self, target):
        row = self.samples.get(target)
        return self.repairs(row) / (row["tried"] - self.alone[target]["tried"]) if row else self.seconds / self.tried

    def collapse(self, target):
        """And the little that is not repairs."""
        done, sum_seconds = self.tried, self.seconds
        for before, here in zip(TARGETS[:1] + TARGETS, TARGETS):
            if here > target:
                break
            sum_seconds += (self.alone[here]["tried"] - done) * (self.per_try(before) + self.per_try(here)) / 2
            done = self.alone[here]["tried"]
        return sum_seconds + self.alone[target]["collapse_seconds"]

    def rearrange(self, target):
        return self.per_swap * self.swaps(self.alone[target])

    def mark(self, target):
        return "" if target in self.measured else "~"


def sequential_tables(figures):
    ours_seconds = {int(word(r, "collapses")): r for r in figures.of("sequential")}
    whole = AsPublished(figures)
    listed = {int(word(r, "collapses")): r for r in figures.of("listing", "mixed") if word(r, "window") == "1"}
    rows = []
    for k, target in enumerate(TARGETS):
        row, other = ours_seconds[target], listed.get(target)
        rows.append([f"{target:,}", f"{PUBLISHED[1][k][0]:,}", seconds(PUBLISHED[1][k][1]), f"{row['iterations']:,}",
                     seconds(row["collapse_seconds"]), f"{whole.mark(target)}{whole.collapse(target):,.0f}", f"{other['iterations']:,}" if other else "-"])
    return table("Table 5.2, one edge after the other", ["collapses", "published iterations", "published s", "iterations", "s",
                 "s with whole-array repairs, as published (~: by samples)", "iterations by the listings, mixed"], rows)


def parallel_tables(figures):
    made, listed, text = figures.table("published"), figures.table("listing", "mixed"), ""
    for number, window in zip((3, 4, 5, 6), WINDOWS):
        rows = []
        for k, target in enumerate(TARGETS):
            row, other = made[window, target], listed.get((window, target))
            rows.append([f"{target:,}", f"{PUBLISHED[window][k][0]:,}", seconds(PUBLISHED[window][k][1]),
                         f"{row['iterations']:,}", seconds(row["collapse_seconds"]), f"{other['iterations']:,}" if other else "-",
                         seconds(other["collapse_seconds"]) if other else "-"])
        text += table(f"Table 5.{number}, windows of {window}",
                      ["collapses", "published iterations", "published s", "iterations", "s",
                      "by the listings, mixed: iterations", "s"], rows) + "\n"
    return text


def rearrange_table(figures):
    ours = {(word(r, "rearrange"), int(word(r, "collapses"))): r["rearrange_seconds"] for r in figures.of("rearrange")}
    whole = AsPublished(figures)
    rows = [[f"{t:,}", seconds(PUBLISHED_REARRANGE["sequential"][k]), seconds(PUBLISHED_REARRANGE["parallel"][k]),
             f"~{seconds(whole.rearrange(t))}", seconds(ours["pointers", t]), f"{1e3 * ours['scan', t]:.2g} ms"] for k, t in enumerate(TARGETS)]
    return table("Table 5.7, vertices rearrange, s",
                 ["collapses", "published, CPU", "published, GPU", "two pointers, CPU (~: by a sample)", "two pointers, GPU", "scan, GPU"], rows)


def speed_tables(figures):
    made, text = figures.table("published"), ""
    alone = {int(word(r, "collapses")): r for r in figures.of("sequential")}
    swaps = {(word(r, "rearrange"), int(word(r, "collapses"))): r["rearrange_seconds"] for r in figures.of("rearrange")}
    whole = AsPublished(figures)
    for number, with_rearrange in ((8, False), (9, True)):
        rows = []
        for k, target in enumerate(TARGETS):
            cells, mark = [f"{target:,}"], "~" if with_rearrange else whole.mark(target)
            for window in WINDOWS:
                before, after = PUBLISHED[1][k][1], PUBLISHED[window][k][1]
                alike, ours_after = whole.collapse(target), made[window, target]["collapse_seconds"]
                ours_before = alone[target]["collapse_seconds"]
                if with_rearrange:
                    before, after = before + PUBLISHED_REARRANGE["sequential"][k], after + PUBLISHED_REARRANGE["parallel"][k]
                    alike = (alike + whole.rearrange(target)) / (ours_after + swaps["pointers", target])
                    ours_before, ours_after = ours_before + alone[target]["rearrange_seconds"], ours_after + swaps["scan", target]
                else:
                    alike /= ours_after
                cells.append(f"{before / after:,.0f} / {mark}{alike:,.0f} / {ours_before / ours_after:.2g}")
            rows.append(cells)
        text += table(f"Table 5.{number}, speed-up published / ours of the published ways / ours of the local sequential and the scan"
                      + (", with the rearrange" if with_rearrange else ""), ["collapses"] + [f"{w} threads" for w in WINDOWS], rows) + "\n"
    return text


def success_table(figures):
    rows = []
    for name, source in (("published", None), ("the text's readings, made terrain", figures.table("published")),
                         ("the listings, mixed terrain", figures.table("listing", "mixed"))):
        if source == {}:
            continue  # it wants a real terrain
        cells = [name]
        for window in WINDOWS:
            if source is None:
                cells.append("about 50 to 20–33")
                continue
            rates = source[window, 400000]["success_percent"]
            tenth = max(1, len(rates) // 10)
            cells.append(f"{sum(rates[:tenth]) / tenth:.0f} to {sum(rates[-tenth:]) / tenth:.0f}")
        rows.append(cells)
    return table("Figures 5.11 to 5.26 in short: success in %, first and last tenth of 400,000 collapses",
                 ["", *map(str, WINDOWS)], rows)


NOISE = ("repair=around", "collapses=400000", "passes=1", "repeat=5", "repeat=2", "order=test-first", "come_back=1",
         "shuffle=keyed", "window=65536", "pool=0.6")


def quality_table(figures, experiment, title, terrain="made", keep_words=False):
    rows = []
    for row in figures.of(experiment, terrain):
        words = row["spec"].split()
        shown = " ".join(words if keep_words else [w for w in words if w not in NOISE]) or "as published"
        fates = row.get("fates", {})
        success = f"{100 * row['collapses'] / row['tried']:.0f} %" if row.get("tried") else "-"
        rows.append([f"`{shown}`", f"{row.get('iterations', 0):,}" if row.get("iterations") else "-", success,
                     f"{1e3 * row['seconds']:.0f}",
                     f"{1e3 * (row['seconds'] - row.get('copy_seconds', 0)):.1f}" if fates else "-", f"{row['rmse_m']:.3f}",
                     f"{row['max_error_m']:.1f}", f"{row['mean_least_angle_deg']:.1f}", f"{row['triangles']:,}"])
    return table(title,
                 ["", "iterations", "success", "ms", "ms without copies",
                  "RMSE m", "greatest m", "mean least angle", "triangles"], rows)


def window_table(figures):
    terrains = [("made 250", "62,500"), ("made 500", "250,000"), ("made", "998,001"), ("made 2000", "4,000,000")]
    rows = {}
    for terrain, _ in terrains:
        for row in figures.of("windows", terrain):
            again = word(row, "come_back") == "1"
            rows.setdefault((int(word(row, "window")), again), {})[terrain] = row
    head = ["window"] + [f"{n} vertices" + (", come back" if again else "") for again in (False, True) for _, n in terrains]
    lines = []
    for window in sorted({w for w, _ in rows}):
        cells = [f"{window:,}"]
        for again in (False, True):
            for terrain, _ in terrains:
                row = rows[window, again].get(terrain)
                cells.append(f"{1e3 * row['collapse_seconds']:.1f} / {row['iterations']}" if row else "-")
        lines.append(cells)
    return table("Milliseconds in windows / iterations, to 60 % of the vertices", head, lines)


def plot(folder, name, title, x, y, curves, extra=(), style="linespoints ps 0.6"):
    """curves: (title, points)"""
    blocks = [f"$d{k} << END\n" + "\n".join(f"{a} {b}" for a, b in points) + "\nEND" for k, (_, points) in enumerate(curves)]
    lines = blocks + ["set terminal svg size 800,500 font 'sans,13' background '#ffffff'", f"set output '{name}.svg'",
                      f"set title '{title}'", f"set xlabel '{x}'", f"set ylabel '{y}'",
                      "set grid", "set key outside right noenhanced", *extra]
    drawn = [f"$d{k} using 1:2 with {style} lw 1.5 title '{label}'" for k, (label, _) in enumerate(curves)]
    script = "\n".join(lines + ["plot " + ", \\\n  ".join(drawn)]) + "\n"
    subprocess.run(["gnuplot"], input=script, text=True, check=True, cwd=folder)


def plots(figures, folder):
    made, listed = figures.table("published"), figures.table("listing", "mixed")
    def told(row):
        return row["iterations"], row["collapse_seconds"]
    ways = [("published", lambda w, k: PUBLISHED[w][k]), ("ours", lambda w, k: told(made[w, TARGETS[k]]))]
    if listed:
        ways.append(("listings, mixed", lambda w, k: told(listed[w, TARGETS[k]])))
    for name, part, title, label in (("time", 1, "Figures 5.3 and 5.4: run-time of the collapse phase", "seconds"),
                                     ("iterations", 0, "Figure 5.9: iterations", "iterations")):
        curves = [(f"{way} {w}", [(TARGETS[k], value(w, k)[part]) for k in range(5)]) for way, value in ways for w in WINDOWS]
        plot(folder, name, title, "collapses", label, curves, ["set logscale y"])
    ours = {(word(r, "rearrange"), int(word(r, "collapses"))): r["rearrange_seconds"] for r in figures.of("rearrange")}
    curves = [(f"published {k}", list(zip(TARGETS, v))) for k, v in PUBLISHED_REARRANGE.items()]
    curves += [(f"ours, {way}", [(t, ours[way, t]) for t in TARGETS]) for way in ("pointers", "scan")]
    plot(folder, "rearrange", "Figures 5.5 and 5.6: vertices rearrange", "collapses", "seconds", curves, ["set logscale y"])
    for label, source, name in (("the text, made terrain", made, "success"),
                                ("the listings, mixed terrain", listed, "success-listings")):
        for target in (50000, 100000, 200000, 400000) if source else ():
            rates = {w: source[w, target]["success_percent"] for w in WINDOWS}
            curves = [(f"window {w}", [(round(100 * k / len(r), 1), v) for k, v in enumerate(r)]) for w, r in rates.items()]
            plot(folder, f"{name}-{target}", f"Figures 5.11 to 5.26: {target:,} collapses, {label}", "% of the iterations",
                 "% of candidates that collapse", curves, ["set yrange [0:100]"], "lines")


def markdown(figures):
    parts = ["# Tables", "Made by report.py from the figures beside it; README.md says what they mean.",
             sequential_tables(figures),
             parallel_tables(figures), rearrange_table(figures), speed_tables(figures), success_table(figures),
             quality_table(figures, "readings", "Readings, pools, races, seeds", keep_words=True),
             quality_table(figures, "faster", "Item 1: all on the GPU, step by step", keep_words=True), window_table(figures),
             quality_table(figures, "metrics", "Item 3: metrics"),
             quality_table(figures, "selections", "Items 4, 5 and 7: candidates", keep_words=True),
             quality_table(figures, "borders", "Item 6: the border"),
             quality_table(figures, "shapes", "Item 8: flips and smoothing")]
    for terrain in ("flat", "valley", "mountain", "mixed", "made"):
        parts.append(quality_table(figures, "terrains", f"Item 9: {terrain}", terrain, keep_words=True))
    parts.append(quality_table(figures, "rivals", "Item 10: the production strategy"))
    return "\n\n".join(parts) + "\n"


def as_html(text, folder):
    out, in_table = [], False
    for line in text.splitlines():
        if line.startswith("|---"):
            continue
        if line.startswith("|"):
            cells = [html.escape(c.strip()).replace("`", "") for c in line.strip("|").split("|")]
            tag = "td" if in_table else "th"
            out.append(("" if in_table else "<table>") + "<tr>" + "".join(f"<{tag}>{c}</{tag}>" for c in cells) + "</tr>")
            in_table = True
            continue
        if in_table:
            out.append("</table>")
            in_table = False
        if line.startswith("# "):
            out.append(f"<h1>{html.escape(line[2:])}</h1>")
        elif line:
            out.append(f"<p>{html.escape(line).replace('**', '')}</p>")
    names = [name for name in sorted(os.listdir(folder)) if name.endswith((".svg", ".png"))]
    pictures = "".join(f'<img src="{name}" alt="{name}">' for name in names)
    style = ("body{font-family:sans-serif;margin:2em}table{border-collapse:collapse}"
             "td,th{border:1px solid #ccc;padding:2px 8px;text-align:right}")
    head = f"<!doctype html><meta charset=utf-8><title>The thesis' experiments, rerun</title><style>{style}</style>"
    return head + "\n".join(out) + pictures


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        figures = Figures(json.load(file)["rows"])
    folder = sys.argv[2]
    os.makedirs(folder, exist_ok=True)
    plots(figures, folder)
    text = markdown(figures)
    for name, body in (("tables.md", text), ("report.html", as_html(text, folder))):
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(body)


if __name__ == "__main__":
    main()
