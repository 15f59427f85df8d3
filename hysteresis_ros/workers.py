# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Spread work over processes, and keep NumPy's own threads out of their way.

Our matrices are small: a BLAS that divides them among threads gains nothing, and on a busy machine
its threads wait for each other most of the time.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
import contextlib
import multiprocessing
from multiprocessing.connection import Connection
import os
import signal
import sys
import threading
import time
from typing import Any
import warnings

try:
    import threadpoolctl
except ImportError:     # rosdep has no key for it: BLAS keeps its threads, which costs time only
    threadpoolctl = None

# Time between two looks at whether the process that gave the work still lives [s].
LOOK_PERIOD = 1.0

# A progress bar: given the items of a long computation and their number, it returns the items.
Progress = Callable[[Iterable, int], Iterable]

# What forks take their items from holds so many at most, of four bytes each, in a pipe of 64 kB.
MOST_TICKETS = 8192

_LOCK = threading.Lock()
_limits: Any = None
_holders: dict[int, int] = {}    # thread to how often it has entered
_watching = False
_dividing = False
_killed: set[int] = set()


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """
    Limit BLAS in this process to one thread, as context or as decorator of a function.

    Without threadpoolctl nothing is limited.

    It may be entered again inside, and by several threads at once: the last to leave restores what
    was before. The main thread does so in any case: from other threads a recent OpenBLAS does not
    take what the main thread has set.
    """
    global _limits
    if threadpoolctl is None:
        yield
        return
    thread = threading.get_ident()
    main = threading.current_thread() is threading.main_thread()
    with _LOCK:
        if not _holders:
            _limits = threadpoolctl.threadpool_limits(1, user_api='blas')
        elif main and thread not in _holders:
            threadpoolctl.threadpool_limits(1, user_api='blas')
        _holders[thread] = _holders.get(thread, 0) + 1
    try:
        yield
    finally:
        with _LOCK:
            _holders[thread] -= 1
            if not _holders[thread]:
                del _holders[thread]
                if _limits is not None and (main or not _holders):
                    _limits.restore_original_limits()


def forks(jobs: int) -> int:
    """
    Return how many processes may share work here; see `map_in_forks`.

    Parameters
    ----------
    jobs : int
        Processes that are wanted, -1 for one on each core.

    Returns
    -------
    int
        1 where this process must not be forked: beside other threads, such as those of a notebook,
        whose locks a fork would hold for ever, and where work is shared already.
    """
    if _dividing or not hasattr(os, 'fork') or threading.active_count() > 1:
        return 1
    return threads(jobs)


def threads(jobs: int) -> int:
    """Return how many threads may be used: one where cores have work from `map_in_forks`."""
    if _dividing:
        return 1
    return cores() if jobs < 0 else max(jobs, 1)


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else (
        os.cpu_count() or 1)


def map_in_forks(function: Callable[[Any], Any], items: Iterable, jobs: int) -> list:
    """
    Return what a function gives for each of some items, in their order.

    Forks of this process do a part of them. They know all that it knows, and what they learn is
    forgotten but for the results; so the function must not change anything that counts. What a fork
    cannot do, or its result not be sent, is done here.

    Parameters
    ----------
    function : callable
        Of one item.
    items : iterable
    jobs : int
        Processes, this one among them; see `forks`.
    """
    global _dividing
    items = list(items)
    count = min(forks(jobs), len(items))
    if count < 2:
        return [function(item) for item in items]
    size = -(-len(items) // MOST_TICKETS)
    tickets, ticket = os.pipe()
    for begin in range(0, len(items), size):
        os.write(ticket, begin.to_bytes(4, 'little'))
    os.close(ticket)
    children: list[tuple[int, Connection]] = []
    results: dict[int, Any] = {}
    _dividing = True
    try:
        with one_blas_thread():
            for _ in range(count - 1):
                children.append(_fork(function, items, _taken(tickets, len(items), size)))
            for index in _taken(tickets, len(items), size):
                results[index] = function(items[index])
            for _, answers in children:
                results.update(_sent(answers))
            return [results[index] if index in results else function(item)
                    for index, item in enumerate(items)]
    finally:
        _dividing = False
        os.close(tickets)
        for process, answers in children:
            answers.close()
            os.kill(process, signal.SIGKILL)
            _killed.add(process)
        _bury()


def _bury() -> None:
    """Let go of forks that have ended; how long that takes, nobody has to wait for."""
    for process in tuple(_killed):
        with contextlib.suppress(ChildProcessError):
            if not os.waitpid(process, os.WNOHANG)[0]:
                continue
        _killed.discard(process)


def _fork(function: Callable[[Any], Any], items: Sequence, taken: Iterable[int]
          ) -> tuple[int, Connection]:
    """Return a fork that takes its part of the items, and where it sends its results."""
    parent = os.getpid()
    answers, answer = multiprocessing.Pipe(duplex=False)
    with warnings.catch_warnings():
        # Threads of BLAS, which Python warns of, are taken care of by BLAS.
        warnings.simplefilter('ignore', DeprecationWarning)
        process = os.fork()
    if process:
        answer.close()
        return process, answers
    try:
        end_with(parent)
        # They are sent in the end: till then nobody reads them, and little fits into a pipe.
        found = []
        for index in taken:
            with contextlib.suppress(Exception):
                found.append((index, function(items[index])))
        for one in found:
            with contextlib.suppress(Exception):
                answer.send(one)
    finally:
        os._exit(0)     # whatever happened, the parent's own work is not done twice


def _taken(tickets: int, count: int, size: int) -> Iterator[int]:
    """Take indices below a count, a few at a time, which nobody else gets, while there are any."""
    while ticket := os.read(tickets, 4):
        begin = int.from_bytes(ticket, 'little')
        yield from range(begin, min(begin + size, count))


def _sent(answers: Connection) -> Iterator[tuple[int, Any]]:
    """Receive the results of a fork, as far as they go."""
    while True:
        try:
            yield answers.recv()
        except Exception:       # the end, or what cannot be read and is done again
            return


def delayed(function: Callable) -> Callable:
    """Return a function that, called with arguments, gives a task for `in_parallel`."""
    return lambda *args, **kwargs: (function, args, kwargs)


def chosen_backend() -> bool:
    """Return whether another joblib backend than processes of this machine is in force."""
    if 'joblib' not in sys.modules:
        return False
    from joblib.parallel import get_active_backend
    return type(get_active_backend()[0]).__name__ not in ('LokyBackend', 'SequentialBackend')


def in_parallel(tasks: Iterable, jobs: int) -> Iterator:
    """
    Yield the results of tasks in their order.

    BLAS has one thread here and in the workers meanwhile, and workers on this machine end when
    this process does, however it ends.

    Parameters
    ----------
    tasks : iterable
        See `delayed`.
    jobs : int
        Processes; 1 for none but this one, -1 for all cores. A joblib backend in force, such as
        dask, is used instead.
    """
    import joblib   # half a second that a model in use does not need
    tasks = [joblib.delayed(_work)(os.getpid(), *task) for task in tasks]
    try:
        parallel = joblib.Parallel(n_jobs=jobs, return_as='generator')
    except ValueError:
        # Dask before joblib 1.4 gives all of them at the end.
        parallel = joblib.Parallel(n_jobs=jobs)
    with one_blas_thread():
        yield from parallel(tasks)


def _work(giver: int, function: Callable, args: tuple, kwargs: dict) -> Any:
    """Do a task that the process `giver` gave."""
    if os.getppid() == giver != os.getpid():
        end_with(giver)
    with one_blas_thread():
        return function(*args, **kwargs)


def end_with(parent: int) -> None:
    """
    End this process, at once, when its parent does; later calls change nothing.

    Linux could send a signal, but does so already when the thread ends that started the worker.
    """
    global _watching
    with _LOCK:
        if _watching:
            return
        _watching = True
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_PERIOD)
    os._exit(1)     # not sys.exit, which ends this thread alone
