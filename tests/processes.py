"""What a test starts ends with it, however it ends: by an exception, a signal, or SIGKILL."""
import atexit
import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import tempfile

_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None)
_started = []


def start(words, limits=None, **how):
    """As subprocess.Popen; limits: called in the process before the program. From the main thread: the kernel ends the process with its thread."""
    owner = os.getpid()
    # One that came between the process's beginning and its place in the list would leave it to the kernel, which ends it a moment later.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})

    def prepare():
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != owner:
            os._exit(127)
        if limits:
            limits()

    try:
        process = subprocess.Popen(words, preexec_fn=prepare, **how)
        _started.append(process)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return process


@atexit.register
def end_all():
    while _started:
        process = _started.pop()
        if process.poll() is None:
            process.kill()
        process.wait()


@contextlib.contextmanager
def folder(prefix):
    """A temporary folder; what was started, in it or not, ends before it goes."""
    with tempfile.TemporaryDirectory(prefix=prefix) as path:
        try:
            yield path
        finally:
            end_all()


if signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
