#!/usr/bin/env python3
"""Whoever ends a soak, ends all of it:  ends.py PROGRAM

soak.py is sent SIGTERM, SIGINT and SIGKILL in the middle of its work, SIGTERM and SIGKILL while it builds its rasters. It must end with 143 or 130 and a
table, and no process and no folder of its may stay behind; after SIGKILL, which nobody can answer, no process."""
import os
import signal
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
import processes  # noqa: E402


def expect(holds, what):
    if not holds:
        print("ends: " + what)
        sys.exit(1)


def processes_in(folder):
    """Command lines that name it, and so all that works there."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open("/proc/%s/cmdline" % pid, "rb") as file:
                words = file.read().replace(b"\0", b" ").decode("utf-8", "replace")
        except OSError:
            continue
        if folder in words:
            found.append("%s %s" % (pid, words))
    return found


def ended(program, number, at_work):
    """Starts a soak, sends the signal, and looks for what is left."""
    what = "%s %s" % (signal.Signals(number).name, "at work" if at_work else "while rasters are built")
    with tempfile.TemporaryDirectory(prefix="cordillera-ends-") as folder:
        log_path = os.path.join(folder, "log")
        inner = os.path.join(folder, "temporary")
        os.mkdir(inner)
        with open(log_path, "wb") as log:
            soak = processes.start([sys.executable, "-B", os.path.join(HERE, "soak.py"), program, "--minutes", "30", "--readers", "20", "--slow", "8",
                                    "--writers", "2", "--rate", "60", "--rasters", "6" if not at_work else "1", "--alive", "2"],
                                   env=dict(os.environ, TMPDIR=inner), stdout=log, stderr=log)
        while soak.poll() is None:
            with open(log_path) as log:
                if at_work and "the work begins" in log.read():
                    break
            if not at_work and any("reference-" in words for words in processes_in(inner)):
                break
            time.sleep(0.02)
        with open(log_path) as log:
            expect(soak.poll() is None, "%s: the soak ended before: %s" % (what, log.read()))
        soak.send_signal(number)
        code = soak.wait()
        with open(log_path) as log:
            said = log.read()
        expect(code == (-number if number == signal.SIGKILL else 128 + number), "%s: exit code %d: %s" % (what, code, said))
        if number == signal.SIGKILL:  # the kernel ends them, a moment later
            while processes_in(inner):
                time.sleep(0.02)
        expect(not processes_in(inner), "%s: still there: %s" % (what, processes_in(inner)))
        expect(number == signal.SIGKILL or not os.listdir(inner), "%s: left: %s" % (what, os.listdir(inner)))
        if at_work and number != signal.SIGKILL:
            expect("ended by signal %d" % number in said and "0 findings" in said, "%s: it said %s" % (what, said))


def main():
    program = os.path.abspath(sys.argv[1])
    for number, at_work in ((signal.SIGTERM, True), (signal.SIGINT, True), (signal.SIGKILL, True), (signal.SIGTERM, False), (signal.SIGKILL, False)):
        ended(program, number, at_work)
        print("%s %s: nothing stayed behind" % (signal.Signals(number).name, "at work" if at_work else "while rasters are built"), flush=True)
    print("ended, and nothing stayed behind")


if __name__ == "__main__":
    main()
