"""Finding 10: few descriptors, files that may not grow, clients that leave while they wait."""
import atexit
import json
import os
import re
import resource
import signal
import socket

from attack import PATIENCE_S, case, connect, eventually, received, request, statuses
from client import cone, noise


def soft(name, limit):
    """For Attack.start: a limit of the server alone."""
    return lambda: resource.setrlimit(name, (limit, limit))


def answered(server):
    """The status that a client of another address gets."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S, source_address=("127.0.0.2", 0)) as client:
        client.sendall(request("GET /healthz"))
        return statuses(client.recv(65536))


@case("10 idle connections beyond ulimit -n 64", expect="200, told")
def few_descriptors(attack):
    server = attack.start(limits=soft(resource.RLIMIT_NOFILE, 64))
    idle = [connect(server) for _ in range(300)]
    seen = answered(server)
    for client in idle:
        client.close()
    with open(server.log.name, errors="replace") as log:
        return seen + (", told" if "the system allows 64 descriptors" in log.read() else ", not told")


@case("10 no descriptor is left for another client", expect="200")
def no_descriptors(attack):
    server = attack.start()
    resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (40, 40))
    idle = [connect(server) for _ in range(200)]
    seen = answered(server)
    for client in idle:
        client.close()
    return seen


@case("10 posts beside idle connections beyond ulimit -n 256", expect="201 201 201 201 201, alive")
def posts_beside_idle(attack):
    server = attack.start(limits=soft(resource.RLIMIT_NOFILE, 256))

    def silent(number):
        return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE_S, source_address=("127.0.1.%d" % (1 + number % 2), 0))

    idle = [silent(number) for number in range(400)]
    body, seen = cone(), []
    for turn in range(5):
        for number in range(turn, 400, 5):  # those that were closed to make room come back
            idle[number].close()
            idle[number] = silent(number)
        seen.append(str(server.ask("POST", "/v1/datasets?name=a%d.asc&crs=EPSG:4326&vertical_datum=ellipsoid" % turn, body, {"Prefer": "wait=60"})[0]))
    alive = server.process.poll() is None
    for client in idle:
        client.close()
    return " ".join(seen) + (", alive" if alive else ", dead")


@case("10 a raster beyond the limit of a file's size", expect="507 200")
def file_size(attack):
    server = attack.start(limits=soft(resource.RLIMIT_FSIZE, 2 << 20))
    body = b"x" * (9 << 20)
    head = "POST /v1/datasets?name=a.tif HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % len(body)
    with connect(server) as client:
        try:
            client.sendall(head.encode() + body)
        except OSError:
            pass  # what is refused is not read to its end
        seen = client.recv(65536)
    return statuses(seen) + " " + answered(server)


def stopped_job(server):
    """Stops the server's job, if there is one by now."""
    jobs = []
    for thread in os.listdir("/proc/%d/task" % server.process.pid):
        with open("/proc/%d/task/%s/children" % (server.process.pid, thread)) as children:
            jobs += [int(pid) for pid in children.read().split()]
    for job in jobs:
        os.kill(job, signal.SIGSTOP)
        # One that is stopped before it has said that it ends with its server would stay for ever.
        atexit.register(kill_if_there, job)
    return jobs


def kill_if_there(process):
    try:
        os.kill(process, signal.SIGKILL)
    except ProcessLookupError:
        pass


@case("10 waiting posts of clients who left", expect="429, then 202")
def waiting(attack):
    server = attack.start(options=("--max-client-streams", "4", "--max-queue", "100"))
    body = cone()

    def post(wait, body=body):
        head = ("POST /v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n"
                "Prefer: wait=%d\r\nConnection: close\r\n\r\n" % (len(body), wait))
        client = connect(server)
        client.sendall(head.encode() + body)
        return client

    def in_use():
        return json.loads(server.ask("GET", "/v1/limits")[2])["in_use"]["waiting_clients"]

    def until(condition):
        assert eventually(condition, 0.05), "still %d wait" % in_use()

    with post(0, noise(301)) as client:  # the builds of all others wait behind this one, which stands still
        assert statuses(client.recv(65536)) == "202"
    until(lambda: stopped_job(server))
    held = [post(600) for _ in range(4)]
    until(lambda: in_use() == 4)
    with post(600) as client:
        first = statuses(client.recv(65536))
    for client in held:
        client.close()
    until(lambda: in_use() == 0)
    with post(1) as client:
        return first + ", then " + statuses(client.recv(65536))


@case("10 meshes for clients who left", expect="most of 200 not made", holds=lambda made: made < 100)
def unwanted(attack):
    # On one core, so that most wait on any machine.
    server = attack.start(limits=lambda: os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}))
    status, _, answer = server.ask("POST", "/v1/datasets?crs=EPSG:4326&vertical_datum=ellipsoid&name=a.asc", noise(301), {"Prefer": "wait=60"})
    assert status == 201, answer
    path = "/v1/datasets/%s/mesh.stl" % json.loads(answer)["id"]
    clients = [connect(server) for _ in range(200)]
    for client in clients:
        client.sendall(request("GET " + path))
    for client in clients:
        client.close()
    with connect(server) as client:  # waits behind them: this address has one turn after the other
        client.sendall(request("GET /v1/datasets"))
        assert statuses(received(client)) == "200"
    counts = re.findall(r'^cordillera_http_requests_total\{.*mesh.*\} ([0-9]+)', server.ask("GET", "/metrics")[2].decode(), re.MULTILINE)
    return sum(int(count) for count in counts)
