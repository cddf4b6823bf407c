"""What a process has open and holds in memory, over time."""
import asyncio
import os
import time


def _status(pid, key):
    with open("/proc/%d/status" % pid) as file:
        for line in file:
            if line.startswith(key + ":"):
                return int(line.split()[1])
    return 0


def slope(points):
    """Of a line through (x, y), by least squares, in y for each x."""
    n = len(points)
    if n < 3:
        return 0.0
    mx, my = sum(x for x, _ in points) / n, sum(y for _, y in points) / n
    return sum((x - mx) * (y - my) for x, y in points) / max(1e-9, sum((x - mx) ** 2 for x, _ in points))


class Watch:
    """Samples of (minutes, RSS in KiB, descriptors, threads)."""

    def __init__(self, pid, every_s):
        self.pid, self.every_s, self.samples, self.start = pid, every_s, [], time.monotonic()

    async def run(self):
        while True:
            await asyncio.sleep(self.every_s)
            try:
                now = (time.monotonic() - self.start) / 60
                self.samples.append((now, _status(self.pid, "VmRSS"), len(os.listdir("/proc/%d/fd" % self.pid)), _status(self.pid, "Threads")))
            except OSError:
                return

    def column(self, number):
        """Of the second half: in the first, caches and pools fill."""
        later = self.samples[len(self.samples) // 2:]
        return [(row[0], row[number]) for row in later]

    def lines(self):
        for name, number, unit in (("memory", 1, "KiB"), ("descriptors", 2, ""), ("threads", 3, "")):
            values = [row[number] for row in self.samples] or [0]
            late = [y for _, y in self.column(number)] or [0]
            yield "%s: least %d, most %d %s; second half %d to %d, mean %d, slope %+.2f %s a minute" % (
                name, min(values), max(values), unit, min(late), max(late), sum(late) / len(late), slope(self.column(number)), unit)
