# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The main function that all nodes share: start, spin, and a clean end however it comes."""

import gc
import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import ExternalShutdownException

from hysteresis_ros.errors import HysteresisError, ParameterError


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
    If the node has a method ``on_shutdown``, it is called first on the way out, while the node
    still can publish its last words to its board.
    """
    node = None
    status = 0
    try:
        _start_rclpy(args)
        node = make_node()
        # What is there now stays for good: collections need not look at it between two messages.
        gc.freeze()
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (HysteresisError, OSError) as error:
        status = _fail(error)
    except RuntimeError:
        # SIGTERM while the node is being made: rclpy is shut down already and refuses the rest.
        if rclpy.ok():
            raise
    finally:
        _ignore_signals()
        status = _end(node) or status
        # Shutting rclpy down put the signal handlers back that it had found.
        _ignore_signals()
    return status


def _start_rclpy(args):
    try:
        rclpy.init(args=args)
    except RuntimeError as error:   # what rclpy makes of arguments that it cannot read
        raise ParameterError(f'ROS arguments: {error}') from None


def _ignore_signals():
    """Ctrl-C on ``ros2 launch`` signals every node twice: the second must not cut the end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)


def _end(node):
    try:
        if hasattr(node, 'on_shutdown'):
            node.on_shutdown()
        return 0
    except (HysteresisError, OSError) as error:
        return _fail(error)
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _fail(error):
    line = ' '.join(str(error).split())
    print(f'error: {line}', file=sys.stderr, flush=True)
    return 1
