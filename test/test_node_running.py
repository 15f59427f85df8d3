# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How every node starts and ends, and how it says how it is."""

import signal
import subprocess
import sys

from node_support import Graph
import pytest
from rclpy.node import Node

from hysteresis_ros.nodes.diagnostics import Diagnostics, ERROR, OK, WARN

PROGRAM = """
import sys, time
from rclpy.node import Node
from hysteresis_ros.errors import BoardError
from hysteresis_ros.nodes.running import run

class Ending(Node):
    def __init__(self):
        super().__init__('ending')
        self.create_timer({period}, self.{method})
        print('up', flush=True)

    def wait(self):
        pass

    def work(self):
        print('begun', flush=True)
        time.sleep(0.3)
        print('done', flush=True)

    def fail(self):
        raise BoardError('the board at\\n/dev/x is silent')

    def stumble(self):
        raise KeyError('a mistake')

    def on_shutdown(self):
        time.sleep(0.3)
        print('zero', flush=True)

sys.exit(run(Ending))
"""


def begin(method, period=0.01):
    """Start the program and wait until its node is up."""
    program = PROGRAM.format(method=method, period=period)
    child = subprocess.Popen([sys.executable, '-c', program], text=True, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, start_new_session=True)
    assert child.stdout.readline() == 'up\n'
    return child


FORGETTING = """
import os, signal, time
from hysteresis_ros.nodes.running import Ending

waking = []
def wake():
    waking.append(True)
    time.sleep(0.3)
    print('woken', flush=True)

ending = Ending()
ending.call(wake)
os.kill(os.getpid(), signal.SIGINT)
while not waking:
    time.sleep(0.01)
ending.call(None)
print('forgotten', flush=True)
"""


def test_what_is_woken_stays_until_it_is_woken():
    """Else a guard condition is triggered that has been destroyed meanwhile: a traceback."""
    done = subprocess.run([sys.executable, '-c', FORGETTING], text=True, capture_output=True,
                          check=False, timeout=60)
    assert (done.stdout, done.stderr) == ('woken\nforgotten\n', '')


@pytest.mark.parametrize('first, second', [
    (signal.SIGINT, signal.SIGINT), (signal.SIGTERM, signal.SIGINT),
    (signal.SIGINT, signal.SIGTERM)])
def test_second_signal_does_not_interrupt_shutdown(domain_id, first, second):
    """`on_shutdown` writes zero, however impatient the other side is."""
    child = begin('wait')
    child.send_signal(first)
    with pytest.raises(subprocess.TimeoutExpired):
        child.wait(0.1)
    child.send_signal(second)
    output, errors = child.communicate(timeout=20)
    assert (child.returncode, output, errors) == (0, 'zero\n', '')


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_running_callback_finishes_after_a_signal(domain_id, number):
    """No exception cuts a message in half, and none is printed."""
    child = begin('work')
    assert child.stdout.readline() == 'begun\n'
    child.send_signal(number)
    output, errors = child.communicate(timeout=20)
    assert (child.returncode, output, errors) == (0, 'done\nzero\n', '')


def test_idle_node_ends_at_once_on_a_signal(domain_id):
    """Its executor sleeps inside DDS, and nothing else would wake it."""
    child = begin('wait', period=1000.0)
    with pytest.raises(subprocess.TimeoutExpired):
        child.wait(0.5)
    child.send_signal(signal.SIGTERM)
    output, errors = child.communicate(timeout=20)
    assert (child.returncode, output, errors) == (0, 'zero\n', '')


def test_user_error_ends_the_node_with_one_line(domain_id):
    """Status 1, and `on_shutdown` is called all the same."""
    output, errors = begin('fail').communicate(timeout=20)
    assert (output, errors) == ('zero\n', 'error: the board at /dev/x is silent\n')


def test_programming_error_keeps_its_traceback(domain_id):
    """It is not dressed up as the user's, and `on_shutdown` is called here, too."""
    child = begin('stumble')
    output, errors = child.communicate(timeout=20)
    assert child.returncode == 1
    assert output == 'zero\n' and 'Traceback' in errors and "KeyError: 'a mistake'" in errors


@pytest.fixture
def graph(domain_id):
    """Give a test a ROS graph of its own."""
    with Graph(domain_id) as graph:
        yield graph


@pytest.fixture
def diagnosed(graph):
    """Return diagnostics that somebody listens to, and the list of statuses."""
    node = graph.add(Node('patient', context=graph.context, namespace='ward'))
    statuses = graph.status()
    diagnostics = Diagnostics(node, 'arm 7', lambda: {'count': 3, 'angle [rad]': 1.23456789})
    graph.listening(node, '/diagnostics')
    return diagnostics, statuses


def test_condition_is_published_at_once_and_every_second(graph, diagnosed):
    """The worst level counts, every sentence is shown, the worst first."""
    diagnostics, statuses = diagnosed
    diagnostics.set('heat', WARN, 'it is hot')
    diagnostics.set('note', OK, 'by the way')
    diagnostics.set('board', ERROR, 'no board')
    complete = 'no board; it is hot; by the way'
    graph.until(lambda: statuses and statuses[-1].message == complete, 'all three')
    # Had it waited for the second to pass, the states between would not have been seen.
    assert [status.message for status in statuses][-3:-1] == ['it is hot', 'it is hot; by the way']
    last = statuses[-1]
    assert last.level == ERROR
    assert (last.name, last.hardware_id) == ('ward/patient', 'arm 7')
    assert {pair.key: pair.value for pair in last.values} == {
        'count': '3', 'angle [rad]': '1.23457'}
    diagnostics.clear('board')
    diagnostics.clear('board')
    graph.until(lambda: statuses[-1].level == WARN, 'the warning that is left')
    assert statuses[-1].message == 'it is hot; by the way'
    count = len(statuses)
    graph.until(lambda: len(statuses) >= count + 2, 'two more by the clock')


def test_lasting_condition_does_not_flood_topic_and_log(graph, diagnosed, capfd):
    """Raised a thousand times, it is published and logged once; its sentence stays the newest."""
    diagnostics, statuses = diagnosed
    for number in range(1000):
        diagnostics.set('target', WARN, f'target {number} refused')
    graph.until(lambda: statuses, 'the change')
    graph.until(lambda: statuses[-1].message == 'target 999 refused', 'the next second')
    assert len(statuses) <= 3
    diagnostics.clear('target')
    log = capfd.readouterr().err
    assert log.count('refused') == 2
    assert 'target 0 refused' in log and 'no longer: target 999 refused' in log
