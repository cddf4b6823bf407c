"""Finding 2: clients that ask for much and hardly read. What the service holds for them is bounded, and given back."""
import json
import os
import re
import socket
import tempfile
import time

from attack import PATIENCE_S, case, statuses
from client import noise

MIB = 1 << 20


def resident(server):
    """Bytes in memory that are no file."""
    with open("/proc/%d/status" % server.process.pid) as status:
        return int(re.search(r"RssAnon:\s+(\d+) kB", status.read())[1]) << 10


def ask_slowly(server, path):
    """A connection whose answer has begun, and its first bytes. Nothing more is read of it."""
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.settimeout(PATIENCE_S)
    client.connect(("127.0.0.1", server.port))
    client.sendall(("GET %s HTTP/1.1\r\nHost: localhost\r\n\r\n" % path).encode())
    return client, client.recv(1024)


def given_back(server, start):
    """MiB above the start, a minute after at the latest."""
    end = time.monotonic() + 60
    while resident(server) > start + 64 * MIB and time.monotonic() < end:
        time.sleep(0.1)
    return (resident(server) - start) // MIB


@case("2 a file of the viewer that 300 clients do not read", expect="MiB above the start: held < 64, after < 64", holds=lambda seen: max(seen) < 64)
def viewer_file(attack):
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "large.bin"), "wb") as file:
            file.write(os.urandom(6 * MIB))
        server = attack.start(options=("--web", folder))
        server.ask("GET", "/large.bin")
        start = resident(server)
        held = [ask_slowly(server, "/large.bin")[0] for _ in range(300)]
        most = (resident(server) - start) // MIB
        for client in held:
            client.close()
        return most, given_back(server, start)


@case("2 large meshes that one client does not read", expect="some, then 503 and Retry-After; MiB after < 64", minutes=True,
      holds=lambda seen: 1 <= seen[0] <= 4 and seen[1] >= 1 and seen[2] == 0 and seen[3] < 128 and seen[4] < 64)
def meshes(attack):
    server = attack.start(options=("--max-client-unsent", "32"))
    status, _, body = server.ask("POST", "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=1", noise(301))
    assert status == 202, body
    dataset = json.loads(body)["id"]
    assert server.wait(dataset) == "ready"
    path = "/v1/datasets/%s/mesh.stl" % dataset
    server.ask("GET", path)
    start = given_back(server, 0) and resident(server)
    answers = [ask_slowly(server, path) for _ in range(12)]
    given = [first for _, first in answers if statuses(first) == "200"]
    refused = [first for _, first in answers if statuses(first) == "503" and b"Retry-After: " in first]
    most = (resident(server) - start) // MIB
    for client, _ in answers:
        client.close()
    return len(given), len(refused), len(answers) - len(given) - len(refused), most, given_back(server, start)
