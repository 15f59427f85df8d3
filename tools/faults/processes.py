# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Hosts and nodes that die while the arm is hot: processes that are killed or stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

from hysteresis_ros.laboratory.board.chip import Chip
from hysteresis_ros.laboratory.board.serial_cable import SerialCable
from hysteresis_ros.laboratory.board.simulated_board import TICK
from hysteresis_ros.laboratory.board.terminal import PortOnTerminal
from tools.faults.run import BOARDS, LatePort, url_of

ROOT = Path(__file__).resolve().parents[2]
HOSTS = {signal.SIGKILL: 'host killed while hot', signal.SIGSTOP: 'host stopped while hot'}
NODES = {'compensator_node': 'compensator node dies in mid-run',
         'geometry_node': 'geometry node dies in mid-run'}
WATCHED = 1.0           # s of the arm after a host was silenced
STARTUP = 300.0         # s of the wall in which nodes must have started; they compile at first

# A host that heats until it dies.
HOST = """
import sys, time
from hysteresis_ros.bridge.board import Board
board = Board(sys.argv[1])
board.start()
board.enable(True)
while True:
    board.set_voltage(5.5)
    time.sleep(0.05)
"""


def _last_heated(cable: SerialCable, begun: float) -> float:
    """Return when a board was last heated within a second; inf where it still is then."""
    last = begun
    while cable.time < begun + WATCHED:
        if cable.board.duty > 0.0:
            last = cable.time + TICK / 1000.0
        time.sleep(0.002)
    return last if cable.board.duty == 0.0 else math.inf


@contextlib.contextmanager
def board_on_terminal(scheme: str, speed: float | None = None) -> Iterator[tuple[str, SerialCable]]:
    """Give a board's terminal and its cable; ``sim`` or ``avr``."""
    url = url_of(scheme, speed=speed)
    if scheme == 'sim':
        port = LatePort(url)
        with PortOnTerminal(port) as terminal:
            yield terminal.name, port.cable
        return
    chip = Chip(url)
    try:
        yield chip.terminal, chip.cable
    finally:
        chip.close()


def silence_host(number: signal.Signals, scheme: str = 'sim', speed: float | None = None
                 ) -> float:
    """
    Stop a host that heats by a signal; return the time until zero duty [s of the arm].

    `scheme` and `speed` as of `kill_node`.
    """
    with board_on_terminal(scheme, speed) as (terminal, cable):
        child = subprocess.Popen([sys.executable, '-c', HOST, terminal],
                                 env={**os.environ, 'PYTHONPATH': str(ROOT)})
        try:
            wait_for(lambda: cable.board.duty > 0.2, 'heating')
            begun = cable.time
            child.send_signal(number)
            return _last_heated(cable, begun) - begun
        finally:
            child.kill()
            child.wait()


def kill_node(name: str, scheme: str = 'sim', speed: float | None = None
              ) -> tuple[float, str]:
    """
    Kill one of the three nodes in the middle of a run.

    Parameters
    ----------
    name : str
        ``compensator_node`` or ``geometry_node``.
    scheme : str
        Of the board: ``sim`` or ``avr``.
    speed : float, optional
        Of the arm's clock against the wall's; None for that of `BOARDS`.

    Returns
    -------
    float
        Time from then until zero volts [s of the arm].
    str
        What the diagnostics said.
    """
    sys.path.insert(0, str(ROOT / 'test'))
    from node_support import Graph, process
    from std_msgs.msg import Float64

    with contextlib.ExitStack() as stack:
        # The nodes are children, who take it from there.
        domain = int(os.environ.setdefault('ROS_DOMAIN_ID', '87'))
        graph = stack.enter_context(Graph(domain))
        voltages: list[tuple[float, float]] = []
        graph.probe.create_subscription(
            Float64, 'applied_voltage',
            lambda message: voltages.append((time.monotonic(), message.data)), 100)
        statuses = graph.status()
        port = url_of(scheme, speed=speed)
        children = {one: stack.enter_context(process(
            one, '--ros-args', '-p', 'telemetry_rate:=50.0', '-p', f'port:={port}'))
            for one in ('bridge_node', 'geometry_node', 'compensator_node')}
        targets = graph.probe.create_publisher(Float64, 'target_angle', 1)
        graph.until(lambda: targets.get_subscription_count() and voltages
                    and graph.probe.count_subscribers('muscle_reference')
                    and graph.probe.count_publishers('muscle_reference'), 'nodes', STARTUP)
        graph.spin(1.0)
        targets.publish(Float64(data=1.9))
        graph.until(lambda: voltages[-1][1] > 1.0, 'heating')
        graph.spin(1.5)
        begun = time.monotonic()
        children[name].kill()
        graph.until(lambda: voltages[-1][1] == 0.0, 'zero volts')
        zero = next(when for when, volts in voltages if when > begun and volts == 0.0)
        graph.spin(1.0)
        assert all(volts == 0.0 for when, volts in voltages if when > zero)
        said = [status.message for status in statuses if 'has died' in status.message]
        rate = BOARDS[scheme][1] if speed is None else speed
        return (zero - begun) * rate, said[-1] if said else ''


def wait_for(condition: Callable[[], object], what: str) -> None:
    """Wait until something is so, at most a minute, on a busy machine."""
    end = time.monotonic() + 60.0
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f'waited for {what}')
        time.sleep(0.002)
