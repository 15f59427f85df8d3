# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From a target angle to a voltage setpoint through two nodes, beside bare relays of the same length.

All chains are pairs of processes that live at the same time, and blocks of messages go through
each in turn, so that what else the machine does falls on all of them alike.
"""

import contextlib
import os
import time

from benchmark.child import child, own_domain
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.nodes.qos import COMMANDS

ANGLES = 1.7, 2.4           # rad, within reach of the bicep
BLOCKS, QUICK_BLOCKS = 300, 3
BLOCK = 10                  # messages of one chain before the next has its turn
RATE = 500                  # targets a second, and for how long [s]
SECONDS, QUICK_SECONDS = 60.0, 0.5
PATIENCE = 20.0             # s for a chain to come up, or for a message to come through

NODE = 'import sys; from hysteresis_ros.nodes.{}_node import main; sys.exit(main())'
RELAY = 'from benchmark.nodes import relay; relay({!r}, {!r}, {!r})'

CHAINS = {
    'nodes': (NODE.format('geometry'), NODE.format('compensator')),
    'same_types': (RELAY.format('target_angle', 'muscle_reference', 'reference'),
                   RELAY.format('muscle_reference', 'voltage_setpoint', 'voltage')),
    'float64': (RELAY.format('target_angle', 'middle', 'same'),
                RELAY.format('middle', 'voltage_setpoint', 'same')),
}


def node_benchmarks(quick: bool) -> dict:
    """
    Measure latency and throughput of `geometry_node` and `compensator_node`.

    Returns
    -------
    dict
        Median and 99th percentile of the latency, as such and over those of a bare relay chain of
        two hops in the same run; targets lost at 500 a second.
    """
    domain = own_domain()
    environment = dict(os.environ, ROS_DOMAIN_ID=str(domain),
                       ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    with contextlib.ExitStack() as stack:
        for name, codes in CHAINS.items():
            for code in codes:
                stack.enter_context(child(code, [
                    '--ros-args', '-r', f'__ns:=/{name}', '-p', 'republish_period:=0.0',
                    '--log-level', 'error'], environment))
        context = rclpy.Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        stack.callback(rclpy.shutdown, context=context)
        probe = stack.enter_context(Probe(context))
        latencies = probe.latencies(QUICK_BLOCKS if quick else BLOCKS)
        lost = probe.lost('nodes', RATE, QUICK_SECONDS if quick else SECONDS)
    median, late = ({name: float(np.percentile(values, percent))
                     for name, values in latencies.items()} for percent in (50, 99))
    results = {'node_chain_latency_median_ms': 1e3 * median['nodes'],
               'node_chain_latency_p99_ms': 1e3 * late['nodes']}
    for name in ('float64', 'same_types'):
        results[f'node_chain_latency_median_over_{name}_relay_ratio'] = (
            median['nodes'] / median[name])
        results[f'node_chain_latency_p99_over_{name}_relay_ratio'] = late['nodes'] / late[name]
    results[f'node_chain_targets_lost_at_{RATE}_per_s_count'] = lost
    return results


class Probe:
    """Publishes targets into each chain's namespace and waits for what comes out of it."""

    def __init__(self, context):
        self._node = rclpy.create_node('probe', context=context)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._node)
        self._targets = {
            name: self._node.create_publisher(Float64, f'{name}/target_angle', COMMANDS)
            for name in CHAINS}
        self._received = dict.fromkeys(CHAINS, 0)
        for name in CHAINS:
            self._node.create_subscription(
                Float64, f'{name}/voltage_setpoint',
                lambda message, name=name: self._count(name), COMMANDS)
        self._angles = np.random.default_rng(1)

    def __enter__(self):
        for name, publisher in self._targets.items():
            end = time.monotonic() + PATIENCE
            self._wait(publisher.get_subscription_count, end, f'the chain {name}')
            # What is sent before the second hop is connected gets lost: try until it is through.
            while self._received[name] == 0 and time.monotonic() < end:
                self._send(name)
                self._spin(0.2)
        self._spin(0.5)
        return self

    def __exit__(self, *error):
        self._executor.shutdown()
        self._node.destroy_node()

    def latencies(self, blocks: int) -> dict:
        """Return the times from target to setpoint [s] of each chain, shape (messages,)."""
        found = {name: [] for name in CHAINS}
        for _ in range(blocks):
            for name in CHAINS:
                found[name] += [self._latency(name) for _ in range(BLOCK)]
        return {name: np.array(values) for name, values in found.items()}

    def lost(self, name: str, rate: float, seconds: float) -> int:
        """Return how many of `rate` targets a second do not come through in `seconds`."""
        before = self._received[name]
        count = int(rate * seconds)
        start = time.monotonic()
        for number in range(count):
            due = start + number / rate
            while (pause := due - time.monotonic()) > 0.0:
                self._executor.spin_once(timeout_sec=pause)
            self._send(name)
        end = time.monotonic() + PATIENCE
        while self._received[name] < before + count and time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.1)
        return before + count - self._received[name]

    def _latency(self, name):
        before = self._received[name]
        start = time.perf_counter()
        self._send(name)
        self._wait(lambda: self._received[name] > before, start + PATIENCE,
                   f'a message through the chain {name}', clock=time.perf_counter)
        return time.perf_counter() - start

    def _send(self, name):
        self._targets[name].publish(Float64(data=self._angles.uniform(*ANGLES)))

    def _count(self, name):
        self._received[name] += 1

    def _wait(self, condition, end, what, clock=time.monotonic):
        while not condition():
            if clock() > end:
                raise HysteresisError(f'benchmark of the nodes: waited in vain for {what}')
            self._executor.spin_once(timeout_sec=0.1)

    def _spin(self, seconds):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.05)


def relay(source: str, destination: str, kind: str) -> None:
    """
    Pass messages on: the least that a node of a chain can do.

    Parameters
    ----------
    source, destination : str
        Topics.
    kind : {'same', 'reference', 'voltage'}
        Float64 to Float64, Float64 to JointState, JointState to Float64.
    """
    before, after, convert = {
        'same': (Float64, Float64, lambda message: message),
        'reference': (Float64, JointState, lambda message: JointState(
            name=['muscle'], position=[message.data], effort=[message.data])),
        'voltage': (JointState, Float64, lambda message: Float64(data=message.position[0])),
    }[kind]
    with contextlib.suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.init()
        node = rclpy.create_node('relay')
        publisher = node.create_publisher(after, destination, COMMANDS)
        node.create_subscription(
            before, source, lambda message: publisher.publish(convert(message)), COMMANDS)
        rclpy.spin(node)
