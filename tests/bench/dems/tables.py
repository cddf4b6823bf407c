"""The figures of bench.py as Markdown, and their places in the documents."""
import os

GRACE_M = 0.001  # the judge's trigonometry is not the builder's
BEGIN, END = "<!-- tables of bench.py -->\n", "<!-- end of tables -->\n"


def measured_m(level):
    return max(level["drc_max_m"], level["glb_max_m"])


def level_holds(level):
    return measured_m(level) <= level["stated_max_m"] + GRACE_M


def looked_at(level):
    """How many samples, and which share of the lattice's."""
    return f"{level['samples']:,}, " + ("all" if level["stride"] == 1 else f"1 in {level['stride'] ** 2}")


def holds(dem):
    """No level deviates more than it states."""
    return all(level_holds(level) for level in dem["levels"])


def number(value):
    """Three digits that count, without an exponent."""
    if value == 0:
        return "0"
    size = abs(value)
    return f"{value:,.0f}" if size >= 100 else f"{value:.1f}" if size >= 10 else f"{value:.2f}" if size >= 1 else f"{value:.3f}"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def where(result):
    s = result["setting"]
    return (f"{s['date']}, {s['cpu']}, {s['cores']} cores, {s['memory_bytes'] / 2**30:.0f} GiB; commit {s['commit']}; "
            f"`{s['command']}`\n")


def summary(result):
    """A row an elevation model; errors are those of its finest level."""
    head = ["elevation model", "pixels", "levels", "tiles", "triangles", ".drc B/triangle", ".glb B/triangle", "MB", "target m", "stated m",
            "measured m", "RMSE m", "levels true", "levels within target", "peak MiB", "CPU s", "wall s", "threads"]
    rows = []
    for dem in result["dems"]:
        finest, levels = dem["levels"][0], dem["levels"]
        total = {name: sum(level[name] for level in levels) for name in ("tiles", "triangles", "drc_bytes", "glb_bytes")}
        rows.append([dem["file"], f"{dem['columns']} x {dem['rows']}", f"{levels[-1]['level']} to {finest['level']}", f"{total['tiles']:,}",
                     f"{total['triangles']:,}", f"{total['drc_bytes'] / total['triangles']:.2f}", f"{total['glb_bytes'] / total['triangles']:.2f}",
                     f"{(total['drc_bytes'] + total['glb_bytes']) / 1e6:.2f}", number(finest["target_m"]), number(finest["stated_max_m"]),
                     number(measured_m(finest)), number(finest["rmse_m"]), f"{sum(map(level_holds, levels))} of {len(levels)}",
                     f"{sum(level['stated_max_m'] <= level['target_m'] for level in levels)} of {len(levels)}",
                     f"{dem['peak_bytes'] / 2**20:.0f}", f"{dem['cpu_s']:.1f}", f"{dem['wall_s']:.1f}", str(dem["threads"])])
    return where(result) + "\n" + table(head, rows)


def by_level(result):
    """A table an elevation model, a row a level. A star: the stated error is a bound, composed of the levels below."""
    head = ["level", "tiles", "triangles", ".drc B/triangle", ".glb B/triangle", "target m", "stated m", "measured .drc m", "measured .glb m",
            "RMSE m", "samples measured", "no triangle there"]
    text = ""
    for dem in result["dems"]:
        rows = []
        for level in dem["levels"]:
            triangles = max(1, level["triangles"])
            stated = number(level["stated_max_m"]) + ("*" if level["composed"] else "") + ("" if level_holds(level) else " **untrue**")
            rows.append([str(level["level"]), f"{level['tiles']:,}", f"{level['triangles']:,}", f"{level['drc_bytes'] / triangles:.2f}",
                         f"{level['glb_bytes'] / triangles:.2f}", number(level["target_m"]), stated, number(level["drc_max_m"]),
                         number(level["glb_max_m"]), number(level["rmse_m"]), looked_at(level), f"{level['unseen']:,}"])
        text += f"\n## {dem['file']}\n\n" + table(head, rows)
    return text


def write(result, folder):
    """Replaces the tables of README.md and all of levels.md."""
    path = os.path.join(folder, "README.md")
    with open(path, encoding="utf-8") as file:
        before, _, rest = file.read().partition(BEGIN)
    _, found, after = rest.partition(END)
    if not found:
        raise SystemExit(f"{path} has no place for the tables: {BEGIN.strip()} and {END.strip()}")
    with open(path, "w", encoding="utf-8") as file:
        file.write(before + BEGIN + "\n" + summary(result) + "\n" + END + after)
    with open(os.path.join(folder, "levels.md"), "w", encoding="utf-8") as file:
        file.write("# Level by level\n\nWritten by bench.py; what the columns mean is in README.md.\n\n" + where(result) + by_level(result))
