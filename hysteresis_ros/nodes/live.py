# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A recording of a running arm that grows: `joint_states`, `applied_voltage`, `ambient_temperature`.

It becomes a measurement as a rosbag2 recording of the same topics does; each heat and cool cycle of
the bridge begins a new trial.
"""

from __future__ import annotations

from array import array
from pathlib import Path
import threading
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64

from hysteresis_ros.atomic import AnyPath
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.bag import (
    arm_run, bridge_initialises, choose_joint, DIAGNOSTICS, Recording)
from hysteresis_ros.nodes.qos import MEASUREMENTS
from hysteresis_ros.nodes.reference import read_angle, seconds

# A muscle has time constants of seconds: rows nearer to each other [s] tell nothing more.
LEAST_STEP = 0.09
# Stamps that go back by more [s] are those of another run of the arm.
JUMP = 1.0
# Fewer rows are no recording yet.
FEWEST_ROWS = 8


class Listener:
    """
    Listens to an arm from a thread of its own, as a context.

    Parameters
    ----------
    source : path
        What the recording is called: the file that it will be saved to.
    namespace : str, optional
        Of the arm.
    domain_id : int, optional
        ROS domain; by default that of the environment.
    """

    def __init__(self, source: AnyPath, namespace: str | None = None,
                 domain_id: int | None = None) -> None:
        self._source, self._namespace = Path(source), namespace or ''
        self._domain_id = domain_id
        self._lock = threading.Lock()
        self._trouble = ''
        self._forget()

    def __enter__(self) -> Listener:
        """Begin to listen."""
        self._context = rclpy.Context()
        # Ctrl-C is the page's.
        rclpy.init(args=[], context=self._context, domain_id=self._domain_id,
                   signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node('studio', context=self._context,
                                       namespace=self._namespace)
        for kind, topic, callback in (
                (JointState, 'joint_states', self._on_joint_states),
                (Float64, 'applied_voltage', self._on_voltage),
                (Temperature, 'ambient_temperature', self._on_ambient),
                (DiagnosticArray, DIAGNOSTICS, self._on_diagnostics)):
            self._node.create_subscription(kind, topic, callback, MEASUREMENTS)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Listen no more."""
        self._executor.shutdown()
        rclpy.try_shutdown(context=self._context)
        self._thread.join()
        self._node.destroy_node()

    def recording(self) -> Measurement | None:
        """
        Return all that was heard so far, None before there is a recording.

        Raises
        ------
        MeasurementError
            If what was heard cannot be a measurement; it says why.
        """
        with self._lock:
            if self._trouble:
                raise MeasurementError(self._trouble)
            columns = [tuple(np.array(column) for column in group) for group in (
                self._voltage, self._angle, self._ambient, self._initialising)]
        found = Recording(*columns)
        if not len(found.voltage[0]) or not np.any(found.angle[0] >= found.voltage[0][0]):
            return None
        columns_of_run = arm_run(self._source, found)
        if len(columns_of_run['angle']) < FEWEST_ROWS:
            return None
        return Measurement.from_columns(columns_of_run, str(self._source))

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            pass

    def _forget(self) -> None:
        """Begin a new recording: received times in ns, and what was received then."""
        self._voltage: tuple[Any, ...] = array('q'), array('d')
        self._angle: tuple[Any, ...] = array('q'), array('d'), array('d')
        self._ambient: tuple[Any, ...] = array('q'), array('d')
        self._initialising: tuple[Any, ...] = array('q'), array('d')

    def _on_joint_states(self, message: JointState) -> None:
        with self._lock:
            try:
                angle = read_angle(message, choose_joint(self._source, message.name))
                self._trouble = ''
            except MeasurementError as error:
                self._trouble = str(error)
                return
            stamp, times = seconds(message.header.stamp), self._angle[1]
            if times and stamp < times[-1] - JUMP:
                latest = [[column[-1:] for column in group] for group in (
                    self._voltage, self._ambient, self._initialising)]
                self._forget()
                self._voltage, self._ambient, self._initialising = map(tuple, latest)
                times = self._angle[1]
            if angle is None or times and stamp < times[-1] + LEAST_STEP:
                return
            append(self._angle, time.monotonic_ns(), stamp, angle)

    def _on_voltage(self, message: Float64) -> None:
        with self._lock:
            # Of a voltage that stays, its beginning is enough.
            if not self._voltage[1] or message.data != self._voltage[1][-1]:
                append(self._voltage, time.monotonic_ns(), message.data)

    def _on_ambient(self, message: Temperature) -> None:
        with self._lock:
            append(self._ambient, time.monotonic_ns(), message.temperature)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        statuses = [(status.name, {entry.key: entry.value for entry in status.values})
                    for status in message.status]
        busy = bridge_initialises(statuses, self._namespace.strip('/'))
        if busy is not None:
            with self._lock:
                append(self._initialising, time.monotonic_ns(), float(busy))


def append(columns: tuple[Any, ...], *values: float) -> None:
    """Add one value to each of some columns."""
    for column, value in zip(columns, values):
        column.append(value)
