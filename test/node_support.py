# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the nodes share: a small muscle, a ROS graph of its own, and processes."""

import contextlib
import gc
import os
import subprocess
import sys
import time

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.nodes.parameters import GEOMETRY
from hysteresis_ros.operators import Preisach

GEOMETRY_OF_TESTS = BicepGeometry(**{spec.name: spec.default for spec in GEOMETRY})
DEADLINE = 60.0         # s, for a busy machine; nobody waits for it where all is well


def small_model(effects=()):
    """Return a coarse muscle of the paper's size: 0.5 to 14.5 N over 0 to 6 V, with memory."""
    cells = 4 * 5 // 2
    force = Preisach(np.linspace(0.0, 6.0, 5), np.full(cells, 14.0 / 36.0), 7.5)
    low, high = (float(GEOMETRY_OF_TESTS.length(angle)) for angle in (0.8, 2.4))
    length = Preisach(np.linspace(-10.0, 6.0, 5), np.full(cells, (high - low) / 256.0),
                      0.5 * (low + high))
    return MuscleModel(
        kind='two-stage', drive='voltage', load_name='force', response='length',
        length_stage=length, force_stage=force, geometry=GEOMETRY_OF_TESTS,
        ranges={'voltage': (0.0, 6.0), 'force': (0.5, 14.5), 'length': (low, high)},
        effects=list(effects))


class Graph:
    """A ROS graph of its own in this process: a domain, an executor, a probe node."""

    def __init__(self, domain):
        gc.freeze()     # so that only what comes now is looked through in the end
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.probe = self.add(rclpy.create_node('probe', context=self.context))

    def add(self, node):
        """Spin the node, too."""
        self.executor.add_node(node)
        return node

    def make(self, kind, model=None, **parameters):
        """Start one of the package's nodes with these parameters."""
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        return self.add(kind(model=model, context=self.context, parameter_overrides=overrides))

    def collect(self, kind, topic, qos=1000):
        """Return a list that fills with the messages of a topic."""
        messages = []
        self.probe.create_subscription(kind, topic, messages.append, qos)
        return messages

    def publisher(self, kind, topic, qos=1000):
        """Return a publisher to which a node listens already."""
        publisher = self.probe.create_publisher(kind, topic, qos)
        self.until(lambda: publisher.get_subscription_count() > 0, f'a subscriber of {topic}')
        return publisher

    def listening(self, node, *topics):
        """Wait until a node knows who listens to what it publishes."""
        self.until(lambda: all(map(node.count_subscribers, topics)), f'subscribers of {topics}')

    def until(self, condition, what, deadline=DEADLINE):
        """Spin until the condition holds; fail when it does not in time."""
        end = time.monotonic() + deadline
        while not condition():
            assert time.monotonic() < end, f'waited {deadline} s for {what}'
            self.executor.spin_once(timeout_sec=0.05)

    def spin(self, seconds):
        """Spin for a while, to show that something does not happen."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def call(self, kind, name, request):
        """Call a service and return its response."""
        client = self.probe.create_client(kind, name)
        self.until(client.service_is_ready, f'service {name}')
        future = client.call_async(request)
        self.until(future.done, f'the answer of {name}')
        return future.result()

    def status(self):
        """Return a list that fills with the statuses of /diagnostics."""
        statuses = []
        self.probe.create_subscription(
            DiagnosticArray, '/diagnostics', lambda m: statuses.extend(m.status), 100)
        return statuses

    def __enter__(self):
        return self

    def __exit__(self, *error):
        nodes = self.executor.get_nodes()
        # It may hold what it waited for last, which is to go first.
        self.executor.shutdown()
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown(context=self.context)
        # What refers to itself keeps a participant alive, which would meet those of later tests and
        # end while they begin: Fast DDS may wait for ever then (its issue 6513).
        del nodes, node, self.probe, self.executor
        gc.collect()
        gc.unfreeze()


@contextlib.contextmanager
def process(module, *arguments):
    """Run a node as a process; on leaving, end it the hard way if it still runs."""
    environment = dict(os.environ, PYTHONUNBUFFERED='1')
    child = subprocess.Popen(
        [sys.executable, '-c', f'import sys; from hysteresis_ros.nodes.{module} import main; '
         'sys.exit(main())', *arguments], env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        yield child
    finally:
        if child.poll() is None:
            child.kill()
        child.communicate()
