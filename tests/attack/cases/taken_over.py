"""Findings M1 to M3: a job that was taken over as soon as it opens its raster. job_probe stands for the program of the job and does what the service's own
does until then; it is started as the service starts its jobs, in the data folder of a running one, and writes down what it tried."""
import contextlib
import ctypes
import hashlib
import json
import os
import platform
import shutil
import subprocess
import tempfile

import processes
from attack import PATIENCE_S, case
from client import cone

REPORTS = 3  # kReportDescriptor
CREATE_RULESET = 444
LISTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "server", "sandbox", "job_calls.tsv")
# Of each of these there has to be one try at the least.
OF_FINDING = {
    "M1": ("truncate(2) another dataset", "creat(2) over another dataset", "write the EGM96 grid", "another EGM96 grid", "write a grid"),
    "M2": ("a key pressed at stderr's terminal", "text pasted into a console", "the terminal", "another session"),
    "M3": ("a signal to the service", "other limits for the service", "the service's priority", "change another dataset's times by utimensat",
           "give another dataset an attribute", "change another dataset's mode by fchmodat2", "shared memory", "the service's environment",
           "the operator's secrets", "a socket of family 2", "another program", "a process by fork"),
}


def has_landlock():
    return ctypes.CDLL(None).syscall(CREATE_RULESET, None, 0, 1) >= 1


def listed():
    """Number to what a job gets that asks for the call, of those that the probe makes."""
    answers = {}
    with open(LISTED, encoding="utf-8") as file:
        for line in file:
            if line.startswith("#"):
                continue
            numbers, name, answer = line.split("\t")[:3]
            first, _, last = numbers.partition("-")
            for number in range(int(first), int(last or first) + 1):
                if answer != "-" and name != "exit_group":
                    answers[number] = "EPERM" if answer == "filtered" else answer  # by its arguments, and these are none that pass
    return answers


def dataset(server):
    status, _, body = server.ask("POST", "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=50", cone(), {"Prefer": "wait=60"})
    assert status == 201, body
    return os.path.join(server.data, "datasets", json.loads(body)["id"])


def as_it_is(folder):
    """Names, contents, modes, owners and times."""
    found = []
    for base, _, names in os.walk(folder):
        for name in sorted(names):
            path = os.path.join(base, name)
            now = os.lstat(path)
            with open(path, "rb") as file:
                found.append((path, hashlib.sha256(file.read()).hexdigest(), now.st_mode, now.st_uid, now.st_mtime_ns, os.listxattr(path)))
    return found


def written(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def start_probe(folder, job, grids):
    """Runs it to its end: a session, a pipe for stderr, few variables, and the descriptor on which it reports."""
    ours, theirs = os.pipe()
    try:
        probe = processes.start([os.path.join(folder, "bin", "job_probe"), "job", job, "--parent", str(os.getpid())], stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={"CORDILLERA_GEOIDS": grids}, start_new_session=True,
                                pass_fds=(REPORTS,), limits=lambda: os.dup2(theirs, REPORTS))
        probe.communicate(timeout=PATIENCE_S)
    finally:
        os.close(ours)
        os.close(theirs)


def findings(job):
    with open(os.path.join(job, "findings"), encoding="utf-8") as file:
        lines = file.read().splitlines()
    assert lines[-1] == "end", "it ended early: " + lines[-1]
    tries = [line[len("attack "):] for line in lines if line.startswith("attack ")]
    calls = {int(number): answer for _, number, answer in (line.split() for line in lines if line.startswith("call "))}
    needed = [line for line in lines if line.startswith("work ")]
    return tries, calls, needed


@contextlib.contextmanager
def place(attack):
    """A folder with the probe and with grids that whoever runs this may write: only the sandbox is between."""
    build = os.path.dirname(os.path.dirname(attack.program))
    with tempfile.TemporaryDirectory(prefix="probe") as folder:
        for name in ("bin", "share", "grids"):
            os.mkdir(os.path.join(folder, name))
        shutil.copy(os.path.join(build, "bin", "job_probe"), os.path.join(folder, "bin"))
        shutil.copy(os.path.join(build, "share", "egm96-15.pgm"), os.path.join(folder, "share"))
        written(os.path.join(folder, "grids", "grid"), "grid")
        yield folder


@contextlib.contextmanager
def beside(other):
    """A job's folder beside that of a dataset, which gets two files that the probe tries to change."""
    job, victims = os.path.join(os.path.dirname(other), "taken-over"), [os.path.join(other, name) for name in ("victim", "second")]
    try:
        os.mkdir(job)
        written(os.path.join(job, "source"), "raster")
        written(os.path.join(job, "job.json"), json.dumps({"id": "job", "name": "source", "raster": "source", "max_seconds": 600,
                                                           "options": {"threads": 1, "device": "cpu"}}))
        for victim in victims:
            written(victim, "victim")
        yield job
    finally:
        shutil.rmtree(job)
        for victim in filter(os.path.exists, victims):
            os.remove(victim)


def taken_over(attack, abi):
    if not has_landlock():
        return "skipped: this kernel has no Landlock switched on"
    other = dataset(attack.server)
    with place(attack) as folder, beside(other) as job:
        share, grids = os.path.join(folder, "share"), os.path.join(folder, "grids")
        written(os.path.join(job, "orders"), "%d 0 %s %s %s\n" % (abi, other, grids, os.path.join(share, "egm96-15.pgm")))
        before = [as_it_is(kept) for kept in (other, share, grids)]
        start_probe(folder, job, grids)
        seen = judged(*findings(job), before != [as_it_is(kept) for kept in (other, share, grids)])
    return seen + (", alive" if attack.server.ask("GET", "/healthz")[0] == 200 else ", dead")


def judged(tries, calls, needed, changed):
    done = [line for line in tries if " refused (" not in line]
    names = {line.rpartition(" refused (")[0] for line in tries}
    missing = [name for wanted in OF_FINDING.values() for name in wanted if name not in names]
    on_table = platform.machine() == "x86_64"  # numbers of x86-64
    wrong = ["call %d is %s" % (number, calls.get(number)) for number, answer in listed().items() if on_table and calls.get(number) != answer]
    useless = [line for line in needed if not line.endswith(" yes")]
    strange = done + missing + wrong + useless + (["a file was changed"] if changed else [])
    return "; ".join(strange) or "%s tries refused, calls as listed" % ("90 and more" if len(tries) >= 90 else len(tries))


AS_PROMISED = "90 and more tries refused, calls as listed, alive"


def holds(seen):
    return seen == AS_PROMISED or seen.startswith("skipped")


@case("M1-M3 a job that was taken over, where Landlock has ABI 1", expect=AS_PROMISED, holds=holds)
def oldest(attack):
    return taken_over(attack, 1)


@case("M1-M3 a job that was taken over, where Landlock has ABI 2", expect=AS_PROMISED, holds=holds)
def of_debian_12(attack):
    return taken_over(attack, 2)


@case("M1-M3 a job that was taken over, with this kernel's Landlock", expect=AS_PROMISED, holds=holds)
def of_this_kernel(attack):
    return taken_over(attack, 0)
