# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Spread work over processes, and keep NumPy's own threads out of their way.

Our matrices are small: a BLAS that divides them among threads gains nothing, and on a busy machine
its threads wait for each other most of the time.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
import contextlib
import math
import multiprocessing
from multiprocessing.connection import Connection
import os
from pathlib import Path
import signal
import sys
import threading
import time
from typing import Any, NoReturn, TypeVar
import warnings

try:
    import threadpoolctl
except ImportError:     # rosdep has no key for it: BLAS keeps its threads, which costs time only
    threadpoolctl = None

# Time between two looks at whether the process that gave the work still lives [s].
LOOK_PERIOD = 1.0

Item = TypeVar('Item')
Result = TypeVar('Result')
# A progress bar: given the items of a long computation and their number, it returns the items.
Progress = Callable[[Iterable, int], Iterable]

# What forks take their items from holds so many at most, of four bytes each: the smallest pipe that
# Linux gives is a page.
MOST_TICKETS = 1000
# Where a control group says how many cores its processes may use, on average.
QUOTA = '/sys/fs/cgroup/cpu.max'
# Threads of BLAS, which Python 3.12 warns of where it is forked, are taken care of by BLAS.
warnings.filterwarnings('ignore', '.*multi-threaded, use of fork', DeprecationWarning, __name__)

_LOCK = threading.Lock()
_limits: Any = None
_holders: dict[int, int] = {}    # thread to how often it has entered
_watching = False
_sharing = False


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
        whose locks a fork would hold for ever, where work is shared already, and on systems whose
        BLAS does not work in a fork.
    """
    if _sharing or sys.platform != 'linux' or threading.active_count() > 1:
        return 1
    if threadpoolctl is None and 'libgomp' in Path('/proc/self/maps').read_text(encoding='utf-8'):
        # Nothing would keep BLAS from its threads by OpenMP, of which a fork has none.
        return 1
    return threads(jobs)


def threads(jobs: int) -> int:
    """Return how many threads may be used: one where cores have work that is shared already."""
    if _sharing:
        return 1
    return cores() if jobs < 0 else max(jobs, 1)


def cores() -> int:
    """Return how many cores this process may use."""
    if not hasattr(os, 'sched_getaffinity'):
        return os.cpu_count() or 1
    found = len(os.sched_getaffinity(0))
    with contextlib.suppress(OSError, ValueError):
        quota, period = Path(QUOTA).read_text(encoding='ascii').split()
        found = min(found, math.ceil(int(quota) / int(period)))     # or 'max', which is no number
    return max(found, 1)


@contextlib.contextmanager
def _shared() -> Iterator[None]:
    """Let nothing in this process, or in a fork of it, share its work meanwhile."""
    global _sharing
    before, _sharing = _sharing, True
    try:
        yield
    finally:
        _sharing = before


def map_in_threads(function: Callable[[Item], Result], items: Iterable[Item], jobs: int
                   ) -> list[Result]:
    """
    Return what a function gives for each of some items, in their order, from threads.

    It pays where most of its time passes in compiled kernels, which do not hold the interpreter.

    Parameters
    ----------
    function : callable
        Of one item. What it changes, it changes for the others, too.
    items : iterable
    jobs : int
        Threads; see `threads`.
    """
    def alone(item: Item) -> Result:
        with one_blas_thread():
            return function(item)

    items, count = list(items), threads(jobs)
    if min(count, len(items)) < 2:
        return [function(item) for item in items]
    with _shared(), ThreadPoolExecutor(count) as pool:
        return list(pool.map(alone, items))


def map_in_forks(function: Callable[[Item], Result], items: Iterable[Item], jobs: int,
                 ended: Callable[[], Any] = lambda: None) -> list[Result]:
    """
    Return what a function gives for each of some items, in their order.

    Forks of this process do a part of them. They know all that it knows, and what they learn is
    forgotten but for the results; so what the function gives must not depend on what else it has
    done before. What a fork cannot do, or its result not be sent, is done here, which raises its
    error if it has one. Warnings of forks go to standard error.

    Parameters
    ----------
    function : callable
        Of one item.
    items : iterable
    jobs : int
        Processes, this one among them; see `forks`.
    ended : callable
        Is called here once for each item, when it has ended.
    """
    items = list(items)
    count = min(forks(jobs), len(items))
    results: dict[int, Result] = {}
    if count > 1:
        with _shared(), one_blas_thread(), contextlib.ExitStack() as stack:
            tickets = _tickets(len(items))
            stack.callback(os.close, tickets)
            size = -(-len(items) // MOST_TICKETS)
            children: list[_Fork] = []
            stack.callback(_end, children)
            with contextlib.suppress(OSError):      # too many processes or files
                while len(children) < count - 1 and _left(tickets):
                    _Fork(function, items, tickets, size, children)
            with contextlib.suppress(Exception):    # it is raised below, if none of before is
                for index in _taken(tickets, size, len(items)):
                    results[index] = function(items[index])
                    ended()
            for _ in _taken(tickets, size, len(items)):
                pass
            for child in children:
                for index, result in child.results():
                    results[index] = result
                    ended()
    found = []
    for index, item in enumerate(items):
        if index not in results:
            results[index] = function(item)
            ended()
        found.append(results[index])
    return found


def _tickets(count: int) -> int:
    """Return a pipe from which indices below a count can be taken, a few at a time."""
    tickets, ticket = os.pipe()
    try:
        for begin in range(0, count, -(-count // MOST_TICKETS)):
            os.write(ticket, begin.to_bytes(4, 'little'))
    finally:
        os.close(ticket)
    return tickets


def _left(tickets: int) -> bool:
    """Return whether any indices can still be taken."""
    import fcntl        # Windows has neither; nothing is forked there
    import termios
    return fcntl.ioctl(tickets, termios.FIONREAD, bytes(4)) != bytes(4)


def _taken(tickets: int, size: int, count: int) -> Iterator[int]:
    """Take indices below a count, which nobody else gets, while there are any."""
    while ticket := os.read(tickets, 4):
        begin = int.from_bytes(ticket, 'little')
        yield from range(begin, min(begin + size, count))


class _Fork:
    """
    A fork of this process that does a part of some items.

    Parameters
    ----------
    function, items
        As of `map_in_forks`.
    tickets, size : int
        Pipe of the items that are still to do, and how many each stands for.
    siblings : list of _Fork
        It is added to.
    """

    def __init__(self, function: Callable[[Any], Any], items: Sequence, tickets: int, size: int,
                 siblings: list['_Fork']) -> None:
        parent, self._sent_all = os.getpid(), False
        self._answers, answer = multiprocessing.Pipe(duplex=False)
        # A signal in between would run the caller's own handlers twice, or leave a fork behind.
        signals = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
        try:
            self._process = os.fork()
            if not self._process:
                _do(function, items, _taken(tickets, size, len(items)), answer, parent, signals)
            siblings.append(self)
        finally:
            answer.close()
            signal.pthread_sigmask(signal.SIG_SETMASK, signals)

    def results(self) -> Iterator[tuple[int, Any]]:
        """Receive its results when it has done all of them."""
        while True:
            try:
                yield self._answers.recv()
            except (EOFError, OSError):
                self._sent_all = True
                return
            except Exception:       # cannot be read, and is done again
                continue

    def end(self) -> None:
        """End it, whatever it does; one that has sent all ends by itself."""
        self._answers.close()
        with contextlib.suppress(ChildProcessError, ProcessLookupError):
            if not self._sent_all:
                os.kill(self._process, signal.SIGKILL)
            os.waitpid(self._process, 0)


def _end(children: Iterable[_Fork]) -> None:
    for child in children:
        child.end()


def _do(function: Callable[[Any], Any], items: Sequence, taken: Iterable[int],
        answer: Connection, parent: int, signals: Iterable[int]) -> NoReturn:
    """Do a part of some items in a fork, send the results, and end."""
    try:
        # Ctrl-C and what the caller does at a signal are its parent's, which ends it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, signals)
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
        os._exit(0)     # whatever happened, what the parent does besides is not done twice


def delayed(function: Callable) -> Callable:
    """Return a function that, called with arguments, gives a task for `in_parallel`."""
    return lambda *args, **kwargs: (function, args, kwargs)


def must_be_sent(jobs: int) -> bool:
    """
    Return whether work has to be shared by `in_parallel`, and not by `map_in_forks`.

    Where another joblib backend than processes of this machine is in force, such as dask; and
    where several jobs are wanted, but no forks are possible.
    """
    return _other_backend() or (threads(jobs) > 1 and forks(jobs) < 2)


def _other_backend() -> bool:
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
