# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The main function that all nodes share: start, spin, and a clean end however it comes."""

from __future__ import annotations

import gc
import signal
import socket
import sys
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from hysteresis_ros.errors import HysteresisError, ParameterError

if TYPE_CHECKING:
    from rclpy.node import Node

ENDING = (signal.SIGINT, signal.SIGTERM)


def run(make_node: Callable, args: Sequence[str] | None = None) -> int:
    """
    Run one node until Ctrl-C or SIGTERM.

    Parameters
    ----------
    make_node : callable
        Returns the node, usually its class. A `HysteresisError` or `OSError` of it, such as a
        wrong parameter or model file, ends the program with one line on stderr.
    args : sequence of str, optional
        Command line; default ``sys.argv``.

    Returns
    -------
    int
        Exit status: 0 after Ctrl-C or SIGTERM, 1 if the node could not start or go on.

    Notes
    -----
    If the node has a method ``on_shutdown``, it is called first on the way out, while the node can
    still publish and write to its board.
    """
    node = None
    status = 0
    ending = Ending()
    try:
        _start_rclpy(args)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        # To be woken is not enough for an executor: it waits on until there is a callback to run.
        ending.call(node.create_guard_condition(lambda: None).trigger)
        # What is there now stays for good: collections need not look at it between two messages.
        gc.freeze()
        while not ending.has_come:
            executor.spin_once()
    except (HysteresisError, OSError) as error:
        status = _fail(error)
    finally:
        ending.call(None)
        status = _end(node) or status
        # Python puts the default handlers back on its way out: a signal then would be the status.
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)
    return status


class Ending:
    """
    Takes Ctrl-C and SIGTERM, and lets the running callback finish first.

    It neither raises an exception in the middle of a callback nor shuts rclpy down from another
    thread: a half-made node could not publish on shutdown. `ros2 launch` signals every node twice;
    the second signal changes nothing.
    """

    def __init__(self) -> None:
        self.has_come = False
        self._wake: Callable[[], object] | None = None
        self._lock = threading.Lock()   # what is woken must not go while it is being woken
        self._heard, self._signalled = socket.socketpair()
        self._signalled.setblocking(False)
        for number in ENDING:
            signal.signal(number, lambda *_: None)
        # The main thread waits inside DDS, where Python runs no signal handlers.
        signal.set_wakeup_fd(self._signalled.fileno(), warn_on_full_buffer=False)
        threading.Thread(target=self._listen, daemon=True).start()

    def call(self, wake: Callable | None) -> None:
        """Have `wake`, which takes nothing, called from another thread when the end comes."""
        with self._lock:
            self._wake = wake

    def _listen(self) -> None:
        self._heard.recv(1)
        self.has_come = True
        with self._lock:
            if self._wake is not None:
                self._wake()


def _start_rclpy(args: Sequence[str] | None) -> None:
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:   # what rclpy makes of arguments that it cannot read
        raise ParameterError(f'ROS arguments: {error}') from None


def _end(node: Node | None) -> int:
    try:
        if node is not None and hasattr(node, 'on_shutdown'):
            node.on_shutdown()
        return 0
    except (HysteresisError, OSError) as error:
        return _fail(error)
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _fail(error: BaseException) -> int:
    line = ' '.join(str(error).split())
    print(f'error: {line}', file=sys.stderr, flush=True)
    return 1
