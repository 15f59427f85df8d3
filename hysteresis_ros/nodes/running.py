# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The main function that all nodes share: start, spin, and a clean end however it comes."""

import gc
import signal
import sys
from collections.abc import Callable, Sequence

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from hysteresis_ros.errors import HysteresisError, ParameterError

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
    If the node has a method ``on_shutdown``, it is called first on the way out, while the node
    still can publish its last words to its board.
    """
    node = None
    status = 0
    # Signals wait until the node is there: half a node could not say its last words.
    signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        _start_rclpy(args)
        node = make_node()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        # What is there now stays for good: collections need not look at it between two messages.
        gc.freeze()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except RuntimeError:
        # SIGTERM shuts rclpy down from a thread of its own, in the middle of anything.
        if rclpy.ok():
            raise
    except (HysteresisError, OSError) as error:
        status = _fail(error)
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
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)


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
