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


def waited_s(pid):
    """How long the threads that a process has now waited for a processor so far, all together."""
    waited = 0
    try:
        for thread in os.listdir("/proc/%d/task" % pid):
            with open("/proc/%d/task/%s/schedstat" % (pid, thread)) as file:
                waited += int(file.read().split()[1])
    except (OSError, IndexError):
        pass  # it, or a thread of it, has gone
    return waited / 1e9


class Pulse:
    """How late this program itself is: what it should do every EVERY_S."""

    EVERY_S = 0.1

    def __init__(self):
        self.due, self.late = None, []  # (when it came, how late) where it was

    async def run(self):
        clock = asyncio.get_running_loop().time
        while True:
            self.due = clock() + self.EVERY_S
            await asyncio.sleep(self.EVERY_S)
            late_s = clock() - self.due
            if late_s > self.EVERY_S:
                self.late.append((clock(), late_s))

    def most_s(self, since=0.0):
        """The latest that it was since then, on the loop's clock."""
        pending = asyncio.get_running_loop().time() - self.due if self.due else 0.0
        return max([late for came, late in self.late if came >= since] + [pending, 0.0])


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
