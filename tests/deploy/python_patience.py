"""How long the Python client waits, and for whom: against a service that says what a script has. The clock is the test's own."""
import contextlib
import copy
import gc
import os
import pickle
import signal
import sys
import threading
import warnings

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from scripted_service import CUT, answer, scripted, stream  # noqa: E402
import cordillera  # noqa: E402
from cordillera import patience, progress  # noqa: E402

VERSION = answer(200, {"version": "1.2.3"})
RUNNING = {"stage": "build", "done": 1, "total": 2, "share": 0.7, "seconds_left": None, "place": None, "state": "running"}
READY = ("ready", {"state": "ready"})
LAZY = {"state": "running", "build": "lazy", "provisional": True, "progress": RUNNING}


class Clock:
    """Goes on by sleeping, and when it is told to."""

    def __init__(self):
        self.now, self.slept = 0.0, []

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds

    def later(self, seconds):
        self.now += seconds


@contextlib.contextmanager
def own_clock():
    clock, kept = Clock(), patience.time
    patience.time = clock
    try:
        yield clock
    finally:
        patience.time = kept


def caught(kind, call):
    try:
        call()
    except kind as error:
        return error
    raise AssertionError("there is no " + kind.__name__)


def asked(service):
    return [line for _, line in service.seen]


def a_lazy_dataset_ends_with_its_tiles():
    first = {**RUNNING, "stage": "queued", "place": 3, "share": 0}
    said = stream(("progress", first), ("tiles", {}), ("progress", {**RUNNING, "build": "lazy"}))
    with scripted(said, answer(200, LAZY)) as there:
        steps = list(cordillera.Service(there.url).dataset("a").watch(timeout=60))
        assert asked(there) == ["GET /v1/datasets/a/events", "GET /v1/datasets/a"], there.seen
    assert [(step.stage, step.place, step.share) for step in steps] == [("queued", 3, 0), ("build", None, 0.7)], steps


def a_refused_stream_is_asked_for_the_status():
    busy = answer(429, {"type": "urn:cordillera:problem:too-many"}, Retry_After="3")
    with own_clock() as clock, scripted(busy, answer(200, {"state": "running", "progress": RUNNING}), busy, answer(200, READY[1])) as there:
        assert [step.share for step in cordillera.Service(there.url).dataset("a").watch()] == [0.7]
        assert clock.slept == [3], clock.slept


def patience_begins_with_the_first_failure():
    heard = threading.Event()
    with own_clock() as clock, scripted((stream(("progress", RUNNING)), heard.wait, CUT), CUT, stream(READY)) as there:
        for _ in cordillera.Service(there.url).dataset("a").watch():
            clock.later(500)  # quiet, and no failure
            heard.set()
    with own_clock() as clock:
        comments = (stream("waiting"), CUT)
        with scripted(*[comments] * 2000, stream(READY)) as there:  # 500 s of pauses
            cordillera.Service(there.url).dataset("a").wait()
            assert sum(clock.slept) > 400
    with own_clock() as clock, scripted() as there:
        assert caught(cordillera.Problem, cordillera.Service(there.url).dataset("a").wait).type == "service-unreachable"
        assert 100 < sum(clock.slept) <= 120, clock.slept


def a_failed_build_is_told_once_whatever_its_status():
    failed = ("failed", {"type": "urn:cordillera:problem:storage-unreachable", "status": 503, "detail": "gone", "request_id": "abc"})
    with own_clock() as clock, scripted(stream(failed)) as there:
        problem = caught(cordillera.Problem, cordillera.Service(there.url).dataset("a").wait)
        assert (problem.type, problem.request_id, clock.slept) == ("storage-unreachable", "abc", [])


def a_timeout_is_the_callers():
    with scripted(stream(("progress", RUNNING), READY), stream(READY)) as there:  # one look
        dataset = cordillera.Service(there.url).dataset("a")
        caught(TimeoutError, lambda: dataset.wait(timeout=0))
        dataset.wait(timeout=0)
    kept = progress.TIMEOUT_S, progress._FIRST_LOOK_S
    progress.TIMEOUT_S = progress._FIRST_LOOK_S = 3600
    try:  # while nothing is said
        with scripted(stream(("progress", RUNNING))) as there:
            caught(TimeoutError, lambda: cordillera.Service(there.url).dataset("a").wait(timeout=0.2))
    finally:
        progress.TIMEOUT_S, progress._FIRST_LOOK_S = kept
    with own_clock() as clock, scripted() as there:  # and while the service is away
        caught(TimeoutError, lambda: cordillera.Service(there.url).dataset("a").wait(timeout=20))
        assert abs(sum(clock.slept) - 20) < 1e-6, clock.slept


def the_error_of_a_signals_handler_is_the_callers():
    def handler(*_):
        raise TimeoutError("of the caller")

    def knock():
        signal.pthread_kill(threading.main_thread().ident, signal.SIGUSR1)

    before = signal.signal(signal.SIGUSR1, handler)
    try:
        for script, call in (((stream(("progress", RUNNING)), knock), lambda service: service.dataset("a").wait()),
                             ((knock,), lambda service: service.version())):
            with scripted(script, VERSION) as there:
                service = cordillera.Service(there.url)
                assert str(caught(TimeoutError, lambda: call(service))) == "of the caller"
                assert len(there.seen) == 1, there.seen
    finally:
        signal.signal(signal.SIGUSR1, before)


def retry_after_is_waited_for():
    busy = answer(503, {"type": "urn:cordillera:problem:queue-full"}, Retry_After="7", X_Request_Id="abc")
    with own_clock() as clock, scripted(busy, busy, VERSION) as there:
        assert cordillera.Service(there.url).version() == "1.2.3" and clock.slept == [7, 7], clock.slept
    with own_clock() as clock, scripted(busy) as there:
        problem = caught(cordillera.Problem, cordillera.Service(there.url, patience_s=6).version)
        assert (problem.type, problem.retry_after_s, problem.request_id, clock.slept) == ("queue-full", 7, "abc", [])


def a_service_that_was_never_there_is_told_at_once():
    with scripted() as there:
        gone = there.url
    with own_clock() as clock:
        service = cordillera.Service(gone)
        for call in (service.version, service.dataset("a").wait, lambda: service.post(b"raster", resume=True)):
            assert caught(cordillera.Problem, call).type == "service-unreachable" and clock.slept == []


def a_rollback_whose_answer_gets_lost_is_done_once():
    kept = answer(200, {"versions": [{"number": 3, "served": True}, {"number": 2, "served": False}]})
    with scripted(kept, CUT, kept) as there:
        cordillera.Service(there.url).dataset("a").rollback()
        assert asked(there)[1:] == ["POST /v1/datasets/a/rollback?to=2"] * 2, there.seen


def problems_can_be_copied():
    problem = cordillera.Problem("option-invalid", "no", status=400, accepted="yes", parameter="error", request_id="abc", retry_after_s=2)
    for copied in [copy.copy(problem), copy.deepcopy(problem)] + [pickle.loads(pickle.dumps(problem, k)) for k in range(pickle.HIGHEST_PROTOCOL + 1)]:
        assert vars(copied) == vars(problem) and str(copied) == "no (accepted: yes)" and type(copied) is cordillera.Problem


def a_fork_has_a_socket_of_its_own():
    with scripted(VERSION, VERSION, VERSION) as there:
        service = cordillera.Service(there.url)
        service.version()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # the threads are the scripted service's, which the child has no use for
            child = os.fork()
        if child == 0:
            code = 1
            try:
                code = 0 if service.version() == "1.2.3" else 1
            finally:
                os._exit(code)
        assert os.waitpid(child, 0)[1] == 0
        service.version()
        assert [number for number, _ in there.seen] == [0, 1, 0], there.seen


def sockets_are_closed():
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        with scripted(VERSION, stream(READY), VERSION, VERSION) as there:
            with cordillera.Service(there.url) as service:
                service.version()
                service.dataset("a").wait()
            service.version()  # anew
            service.close()
            service.version()
            assert [number for number, _ in there.seen] == [0, 1, 2, 3], there.seen
            del service
            gc.collect()
    assert not [one for one in told if issubclass(one.category, ResourceWarning) and "raddr" in str(one.message)], [str(one.message) for one in told]


for test in (a_lazy_dataset_ends_with_its_tiles, a_refused_stream_is_asked_for_the_status, patience_begins_with_the_first_failure,
             a_failed_build_is_told_once_whatever_its_status, a_timeout_is_the_callers, the_error_of_a_signals_handler_is_the_callers,
             retry_after_is_waited_for, a_service_that_was_never_there_is_told_at_once,
             a_rollback_whose_answer_gets_lost_is_done_once, problems_can_be_copied, a_fork_has_a_socket_of_its_own,
             sockets_are_closed):
    test()
