"""A proxy that breaks connections, for tests of those who must go on after it."""
import contextlib
import socket
import threading


def _pump(source, target, cut):
    try:
        while piece := source.recv(65536):
            if cut(len(piece)):
                break
            target.sendall(piece)
    except OSError:
        pass
    for end in (source, target):
        with contextlib.suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)


@contextlib.contextmanager
def between(port, after, often):
    """Listens before the service at port. A connection is cut once `after` bytes have gone to the service in all, and so `often` times."""
    listener = socket.create_server(("127.0.0.1", 0))
    lock, state = threading.Lock(), {"bytes": 0, "cuts": 0}

    def cut(count):
        with lock:
            state["bytes"] += count
            if state["cuts"] == often or state["bytes"] < after:
                return False
            state["bytes"] = 0
            state["cuts"] += 1
            return True

    def serve():
        with contextlib.suppress(OSError):
            while True:
                near, _ = listener.accept()
                far = socket.create_connection(("127.0.0.1", port))
                for ends in ((near, far, cut), (far, near, lambda count: False)):
                    threading.Thread(target=_pump, args=ends, daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield listener.getsockname()[1]
        assert state["cuts"] == often, "only %d connections were cut" % state["cuts"]
    finally:
        listener.close()
