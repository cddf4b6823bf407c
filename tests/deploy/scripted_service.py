"""A service of few words, for tests of clients: each request gets the next answer of a script."""
import contextlib
import json
import socket
import threading

CUT = b""
"""The connection ends without an answer."""


def answer(status, body=b"", **headers):
    if not isinstance(body, bytes):
        body = json.dumps(body).encode()
    lines = ["HTTP/1.1 %d Said" % status, "Content-Length: %d" % len(body)] + ["%s: %s" % (name.replace("_", "-"), value) for name, value in headers.items()]
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


def stream(*events):
    """The beginning of a stream; a text is a comment."""
    said = [": %s\n\n" % event if isinstance(event, str) else "event: %s\ndata: %s\n\n" % (event[0], json.dumps(event[1])) for event in events]
    return b"HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nConnection: close\r\n\r\n" + "".join(said).encode()


def _request(file):
    line = file.readline().decode().rsplit(" ", 1)[0]
    length = 0
    while (header := file.readline().decode().strip().lower()):
        if header.startswith("content-length:"):
            length = int(header.split(":")[1])
    file.read(length)
    return line


class Scripted:
    def __init__(self, script):
        self._script, self._lock, self._open = list(script), threading.Lock(), []
        self.seen = []  # (number of the connection, method and path)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = "http://127.0.0.1:%d" % self._listener.getsockname()[1]
        self._accepting = threading.Thread(target=self._accept, daemon=True)
        self._accepting.start()

    def _accept(self):
        with contextlib.suppress(OSError):
            for number in range(1 << 30):
                end, _ = self._listener.accept()
                self._open.append(end)
                threading.Thread(target=self._talk, args=(end, number), daemon=True).start()

    def _talk(self, end, number):
        with contextlib.suppress(OSError), end.makefile("rb") as file:
            while line := _request(file):
                with self._lock:
                    self.seen.append((number, line))
                    said = self._script.pop(0) if self._script else CUT
                for piece in said if isinstance(said, tuple) else (said,):
                    if callable(piece):
                        piece()
                        continue
                    if piece == CUT:
                        end.shutdown(socket.SHUT_RDWR)
                        return
                    end.sendall(piece)

    def close(self):
        self._listener.shutdown(socket.SHUT_RDWR)  # close() alone would leave the port to who waits in accept()
        self._accepting.join()
        self._listener.close()
        for end in self._open:
            end.close()


@contextlib.contextmanager
def scripted(*script):
    """An answer is bytes, CUT, or a tuple of these and of functions to be called. A stream without CUT stays open."""
    service = Scripted(script)
    try:
        yield service
    finally:
        service.close()
