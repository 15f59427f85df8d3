# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Work in several processes: threads of BLAS, and what becomes of workers without a parent."""

import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time

from model_support import arm_run, bicep_model
import numpy as np
import pytest
import threadpoolctl

from hysteresis_ros import workers
from hysteresis_ros.diagnosis import bench_selection
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.workers import (
    cores, delayed, forks, in_parallel, map_in_forks, map_in_threads, MOST_TICKETS, must_be_sent,
    one_blas_thread, threads as threads_for)

# Four each: their own time is a part of a second.
WORKING = """
import os, sys, time
from hysteresis_ros.workers import delayed, in_parallel, map_in_forks

def work(folder):
    open(os.path.join(folder, str(os.getpid())), 'w').close()
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        pass

"""
WAYS = {'workers': 'list(in_parallel([delayed(work)(sys.argv[1])] * 4, 2))',
        'forks': 'map_in_forks(work, [sys.argv[1]] * 4, 2)'}


def threads():
    """Return the numbers of threads of the BLAS libraries loaded here."""
    return [library['num_threads'] for library in threadpoolctl.threadpool_info()
            if library['user_api'] == 'blas']


def threads_of_worker():
    """Return the worker's process and its numbers of threads."""
    np.ones((2, 2)) @ np.ones((2, 2))
    return os.getpid(), threads()


@pytest.fixture
def three():
    """Give BLAS three threads, whatever the machine has."""
    with threadpoolctl.threadpool_limits(3, user_api='blas'):
        if set(threads()) != {3}:
            pytest.skip('this BLAS has no threads')
        yield


def test_two_threads_at_once_leave_no_limit_behind(three):
    """Such as two diagnoses of a notebook: each saving and restoring alone would end with one."""
    entered, leave = threading.Event(), threading.Event()

    def other():
        with one_blas_thread():
            entered.set()
            leave.wait(10.0)

    with one_blas_thread():
        with one_blas_thread():
            assert set(threads()) == {1}
        assert set(threads()) == {1}
        thread = threading.Thread(target=other)
        thread.start()
        assert entered.wait(10.0)
        assert set(threads()) == {1}
    assert set(threads()) == {3}
    leave.set()
    thread.join()
    assert set(threads()) == {3}


def test_the_limit_ends_with_an_error(three):
    """A diagnosis that fails leaves no trace."""
    @one_blas_thread()
    def fail():
        raise ValueError(threads())

    with pytest.raises(ValueError, match='1'):
        fail()
    assert set(threads()) == {3}


def test_a_diagnosis_leaves_blas_one_thread(three):
    """And what the user had set afterwards."""
    seen = []

    def progress(iterable, total):
        for item in iterable:
            seen.extend(threads())
            yield item

    rng = np.random.default_rng(1)
    voltage = np.concatenate([np.linspace(1.0, 5.0, 20), np.linspace(5.0, 1.0, 20)])
    run = arm_run(voltage)
    model = bicep_model()
    run.columns['angle'] = model.predict(run) + rng.normal(0.0, 0.002, len(voltage))
    diagnose(model, [run], progress=progress)
    assert seen and set(seen) == {1}
    assert set(threads()) == {3}


def test_adding_effects_to_a_bench_leaves_blas_one_thread(three, monkeypatch):
    """After the diagnosis, too: two threads that wait for a busy core take 25 times as long."""
    seen, fit = [], BenchFitter.fit

    def watched(self, *args, **options):
        seen.extend(threads())
        return fit(self, *args, **options)

    monkeypatch.setattr(BenchFitter, 'fit', watched)
    monkeypatch.setattr(bench_selection, 'observable', lambda problem: (['stress_dependence'], {}))
    drive = np.concatenate([np.linspace(0.0, 6.0, 15), np.linspace(6.0, 0.0, 15)])
    model, loads = bicep_model(), (1.0, 3.0, 5.0)
    table = Measurement.from_columns({
        'trial': np.repeat(np.arange(3.0), 30), 'step': np.tile(np.arange(30.0), 3),
        'voltage': np.tile(drive, 3), 'force': np.repeat(loads, 30), 'length': np.zeros(90)})
    table.columns['length'] = model.predict(table)
    add_effects(model, table)
    assert seen and set(seen) == {1}
    assert set(threads()) == {3}


@pytest.mark.slow
def test_workers_have_one_thread_each(three):
    """In a process of its own as well."""
    found = list(in_parallel([delayed(threads_of_worker)()] * 4, 2))
    assert all(process != os.getpid() and set(numbers) == {1} for process, numbers in found)


def test_results_come_in_the_order_of_the_tasks():
    """Whoever is done first."""
    tasks = [delayed(time.sleep)(0.2), delayed(divmod)(7, 2), delayed(sorted)([2, 1], reverse=True)]
    for jobs in (1, 2):
        assert list(in_parallel(tasks, jobs)) == [None, (3, 1), [2, 1]]


def worked(item):
    """Return who does an item, so slowly that others take some, too."""
    time.sleep(0.02)
    return item, os.getpid()


def test_a_system_without_forks_can_import_it(root):
    """Windows has none of these modules."""
    code = ("import sys; sys.modules['fcntl'] = sys.modules['termios'] = None; "
            'from hysteresis_ros.workers import map_in_forks; print(map_in_forks(abs, [-1, 2], 1))')
    done = subprocess.run([sys.executable, '-c', code], cwd=root, capture_output=True, text=True,
                          check=True)
    assert done.stdout == '[1, 2]\n'


def test_forks_do_a_part_and_results_come_in_order(forkable):
    """Whoever does an item; what a fork knows needs not be sent to it."""
    scale = 3
    found = map_in_forks(lambda item: worked(scale * item), range(20), 3)
    assert [item for item, _ in found] == list(range(0, 60, 3))
    assert len({process for _, process in found}) == 3


def test_more_items_than_fit_into_a_pipe_are_all_done(forkable):
    """A pipe holds a page at least, and then a writer waits for a reader."""
    assert map_in_forks(lambda item: bytes(100) + bytes(item % 7), range(40_000), 2) == [
        bytes(100) + bytes(item % 7) for item in range(40_000)]
    for count in (1, 2, 999, 1000, 1001):
        assert map_in_forks(abs, range(count), 2) == list(range(count))
    assert MOST_TICKETS * 4 <= 4096


class Unreadable:
    """What can be sent, and not be read."""

    def __init__(self, item):
        self.item = item

    def __call__(self):
        return self.item

    def __reduce__(self):
        return int, ('no number',)


@pytest.mark.parametrize('fail', [
    lambda item: os._exit(1), lambda item: sys.exit(), lambda item: [][item],
    lambda item: Unreadable(item), lambda item: lambda: item])
def test_what_a_fork_fails_at_is_done_here(forkable, fail):
    """It dies, ends, raises, or has a result that cannot be read or sent."""
    here = os.getpid()

    def fails(item):
        time.sleep(0.01)
        return (lambda: item) if os.getpid() == here else fail(item)

    assert [found() for found in map_in_forks(fails, range(12), 2)] == list(range(12))


def test_results_behind_one_that_cannot_be_read_are_taken(forkable):
    """Each is sent by itself."""
    def odd(item):
        time.sleep(0.02)
        return Unreadable(item) if item < 4 and os.getpid() != here else worked(item)

    here = os.getpid()
    found = map_in_forks(odd, range(16), 2)
    assert [item for item, _ in found] == list(range(16))
    assert len({process for _, process in found}) == 2


@pytest.mark.parametrize('jobs', [1, 2, 3])
def test_the_first_error_is_raised_whoever_meets_which(forkable, jobs):
    """As without forks, after what comes before it has ended."""
    def fail(item):
        time.sleep(0.01 * (4 - item % 4))
        if item >= 2:
            raise ValueError(item)
        return item

    for _ in range(3):
        with pytest.raises(ValueError, match='^2$'):
            map_in_forks(fail, range(9), jobs)


def test_after_an_error_forks_take_no_more(forkable, tmp_path):
    def fail(item):
        (tmp_path / str(item)).touch()
        if os.getpid() == here:
            raise ValueError
        time.sleep(0.05)

    here = os.getpid()
    with pytest.raises(ValueError):
        map_in_forks(fail, range(100), 2)
    assert len(list(tmp_path.iterdir())) < 50


def test_nothing_is_left_of_forks(forkable):
    """No process, not even a dead one, no file and no limit, also where there was an error."""
    def hangs(item):
        if os.getpid() != here:
            time.sleep(60.0)
        time.sleep(0.05)
        raise KeyboardInterrupt

    here, before = os.getpid(), (processes(), len(os.listdir('/proc/self/fd')))
    started = time.monotonic()
    map_in_forks(worked, range(4), 3)
    with pytest.raises(KeyboardInterrupt):
        map_in_forks(hangs, range(4), 3)
    assert time.monotonic() - started < 30.0
    assert (processes(), len(os.listdir('/proc/self/fd'))) == before
    assert forks(2) == 2


def processes():
    """Return the children of this process, dead or alive."""
    tasks = Path('/proc/self/task').glob('*/children')
    return {child for task in tasks for child in task.read_text(encoding='ascii').split()}


def test_where_no_process_can_be_forked_all_is_done_here(forkable, monkeypatch):
    """Too many processes, or too many files."""
    def refuse(*_):
        raise BlockingIOError(11, 'Resource temporarily unavailable')

    monkeypatch.setattr(os, 'fork', refuse)
    assert {process for _, process in map_in_forks(worked, range(4), 2)} == {os.getpid()}


def test_a_process_that_does_not_ask_after_its_children_can_fork(forkable):
    """Supervisors start programs so; the system then buries children at once."""
    def ends(item):
        return worked(item) if os.getpid() == here else os._exit(0)

    here, before = os.getpid(), signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    try:
        found = map_in_forks(ends, range(9), 3)
    finally:
        signal.signal(signal.SIGCHLD, before)
    assert [item for item, _ in found] == list(range(9))


def test_handlers_of_the_caller_do_not_run_in_forks(forkable):
    """Ctrl-C reaches all processes of a terminal, and a handler may move hardware."""
    def raised(item):
        before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
        time.sleep(0.02)
        return os.getpid(), before

    before = signal.signal(signal.SIGTERM, lambda *_: None)
    try:
        found = map_in_forks(raised, range(8), 2)
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    finally:
        signal.signal(signal.SIGTERM, before)
    assert {handlers for process, handlers in found if process != os.getpid()} == {
        (signal.SIG_IGN, signal.SIG_DFL)}
    assert not {signal.SIGINT, signal.SIGTERM} & set(mask)


def test_forks_have_one_thread_of_blas_each(forkable, three):
    found = map_in_forks(lambda item: (worked(item)[1], threads()), range(8), 2)
    assert len({process for process, _ in found}) == 2
    assert all(set(numbers) == {1} for _, numbers in found)
    assert set(threads()) == {3}


def test_a_bar_goes_on_with_each_item(forkable):
    """That of this process when it ends, that of others when their results come."""
    for jobs in (1, 2):
        times = []
        map_in_forks(worked, range(10), jobs, lambda: times.append(time.monotonic()))
        assert len(times) == 10 and times[2] - times[0] > 0.03


def test_nothing_is_forked_beside_other_threads(forkable):
    """Their locks would never be opened in a fork; nor are there forks of forks."""
    ended = threading.Event()
    thread = threading.Thread(target=ended.wait)
    thread.start()
    try:
        assert forks(2) == 1 and must_be_sent(2) and not must_be_sent(1)
        assert {process for _, process in map_in_forks(worked, range(4), 2)} == {os.getpid()}
    finally:
        ended.set()
        thread.join()
    assert forks(2) == 2 and forks(-1) == cores() and not must_be_sent(2)
    inside = map_in_forks(lambda item: (forks(2), threads_for(2), worked(item)[1]), range(8), 2)
    assert all(one[:2] == (1, 1) for one in inside)
    assert len({one[2] for one in inside}) == 2
    assert threads_for(2) == 2


def test_another_backend_is_used_instead_of_forks(forkable):
    import joblib
    with joblib.parallel_config(backend='threading'):
        assert must_be_sent(2)
    assert not must_be_sent(2)


def test_threads_do_a_part_and_do_not_share_further():
    found = map_in_threads(lambda item: (item, threads_for(4), worked(item) and
                                         threading.get_ident()), range(8), 2)
    assert [one[:2] for one in found] == [(item, 1) for item in range(8)]
    assert len({one[2] for one in found}) == 2
    assert threads_for(4) == 4


@pytest.mark.parametrize('quota, most', [
    ('150000 100000', 2), ('max 100000', 10_000), ('', 10_000)])
def test_a_container_has_as_many_cores_as_it_may_use(monkeypatch, tmp_path, quota, most):
    (tmp_path / 'cpu.max').write_text(quota)
    monkeypatch.setattr(workers, 'QUOTA', tmp_path / 'cpu.max')
    monkeypatch.setattr(os, 'sched_getaffinity', lambda process: range(64))
    assert cores() == min(most, 64)


@pytest.mark.slow
@pytest.mark.parametrize('way', WAYS)
@pytest.mark.skipif(not Path('/proc').is_dir(), reason='processes are looked up in /proc')
def test_workers_end_when_their_parent_is_killed(root, tmp_path, way):
    """SIGKILL leaves no time to tell them, and a batch system uses it."""
    parent = subprocess.Popen([sys.executable, '-c', WORKING + WAYS[way], str(tmp_path)],
                              cwd=root)
    try:
        workers = set()
        deadline = time.monotonic() + 60.0
        while len(workers) < 2:
            assert parent.poll() is None and time.monotonic() < deadline
            time.sleep(0.1)
            workers = {int(path.name) for path in tmp_path.iterdir()}
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        deadline = time.monotonic() + 15.0
        while any(map(alive, workers)):
            assert time.monotonic() < deadline, 'workers go on without their parent'
            time.sleep(0.1)
    finally:
        parent.kill()
        for process in filter(alive, workers):
            os.kill(process, signal.SIGKILL)


def alive(process):
    """Return whether a process runs; one that nobody has buried yet does not."""
    try:
        status = Path('/proc', str(process), 'stat').read_text(encoding='ascii')
    except OSError:
        return False
    return status.rpartition(')')[2].split()[0] != 'Z'
