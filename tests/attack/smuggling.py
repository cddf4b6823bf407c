"""The table of smuggling.tsv: requests that two programs may read in two ways, what we answer and what nginx does.

Columns, separated by tabs: what, bytes, our statuses, nginx's. In the bytes \\r, \\n, \\t, \\\\ and \\xHH are what they are in C; {post} is the
beginning of a head, {next} a whole request that ends its connection: how often it is answered says how the bytes before it were read."""
import os
import re
import socket

import attack

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "smuggling.tsv")
POST = b"POST /v1/datasets?name=a HTTP/1.1\r\nHost: localhost\r\n"
NEXT = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
ESCAPES = {"r": b"\r", "n": b"\n", "t": b"\t", "\\": b"\\"}


def bytes_of(text):
    plain = re.sub(rb"\\(x[0-9a-f]{2}|.)", lambda found: escaped(found[1].decode()), text.encode())
    return plain.replace(b"{post}", POST).replace(b"{next}", NEXT)


def escaped(word):
    return bytes([int(word[1:], 16)]) if word[0] == "x" else ESCAPES[word]


def rows():
    with open(TABLE, encoding="utf-8") as table:
        return [line.rstrip("\n").split("\t") for line in table if not line.startswith("#")]


def answers(port, sent):
    """The statuses of all answers to the bytes, after which the client says that no more will come."""
    with socket.create_connection(("127.0.0.1", port), timeout=attack.PATIENCE_S) as client:
        client.sendall(sent)
        client.shutdown(socket.SHUT_WR)
        return attack.statuses(attack.received(client))


def write(table):
    with open(TABLE, encoding="utf-8") as file:
        head = [line for line in file if line.startswith("#")]
    with open(TABLE, "w", encoding="utf-8") as file:
        file.writelines(head)
        file.writelines("\t".join(row) + "\n" for row in table)
