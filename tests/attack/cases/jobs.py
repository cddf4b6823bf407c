"""Findings M1 to M3: what a running job has of its service, seen from outside. sandbox_test tries from inside what it may do."""
import os
import time

from attack import PATIENCE_S, case
from client import cone


def children(parent):
    for name in os.listdir("/proc"):
        if not name.isdigit():
            continue
        try:
            with open("/proc/%s/stat" % name) as file:
                fields = file.read().rpartition(")")[2].split()
            if int(fields[1]) == parent:
                yield int(name), int(fields[3])  # and its session
        except OSError:
            pass  # it has ended


def status(pid):
    with open("/proc/%d/status" % pid) as file:
        return dict(line.rstrip("\n").split(":\t", 1) for line in file if ":\t" in line)


def look_at(pid, session):
    """None: it is not confined yet, or not any more there."""
    try:
        state = status(pid)
        if state["Seccomp"] != "2" or state["State"].startswith("Z"):
            return None
        with open("/proc/%d/environ" % pid, "rb") as file:
            environment = file.read()
        words = os.readlink("/proc/%d/fd/2" % pid)
        return " ".join(["secret" if b"AWS_SECRET" in environment else "no-secret",
                         "own-session" if session == pid else "shared-session", words.split(":")[0], "NoNewPrivs=" + state["NoNewPrivs"]])
    except OSError:
        return None


@case("M1-M3 a job has a filter, a session and a stderr of its own, and no secrets",
      expect="no-secret own-session pipe NoNewPrivs=1")
def running_job(attack):
    os.environ["AWS_SECRET_ACCESS_KEY"] = "secret"
    try:
        server = attack.start()
    finally:
        del os.environ["AWS_SECRET_ACCESS_KEY"]
    raster, end = cone(size=600), time.monotonic() + PATIENCE_S
    while time.monotonic() < end:  # a job may end between two looks: then another
        state, _, _ = server.ask("POST", "/v1/datasets?name=cone.asc&crs=EPSG:4326&error=1", raster)
        if state != 202:
            return state
        until = time.monotonic() + 5
        while time.monotonic() < until:
            for pid, session in children(server.process.pid):
                seen = look_at(pid, session)
                if seen:
                    return seen
    return "no job was seen"
