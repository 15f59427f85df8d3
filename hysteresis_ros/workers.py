# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Spread work over processes, and keep NumPy's own threads out of their way.

Our matrices are small: a BLAS that divides them among threads gains nothing, and on a busy machine
its threads wait for each other most of the time.
"""

from collections.abc import Callable, Iterable, Iterator
import contextlib
import os
import threading
import time
from typing import Any

try:
    import threadpoolctl
except ImportError:     # rosdep has no key for it: BLAS keeps its threads, which costs time only
    threadpoolctl = None

# Time between two looks at whether the process that gave the work still lives [s].
LOOK_PERIOD = 1.0

# A progress bar: given the items of a long computation and their number, it returns the items.
Progress = Callable[[Iterable, int], Iterable]

_LOCK = threading.Lock()
_limits: Any = None
_holders: dict[int, int] = {}    # thread to how often it has entered
_watching = False


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


def delayed(function: Callable) -> Callable:
    """Return a function that, called with arguments, gives a task for `in_parallel`."""
    return lambda *args, **kwargs: (function, args, kwargs)


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
