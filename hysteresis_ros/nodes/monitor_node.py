# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The model run along with the arm: its prediction, the residual, and what the model lacks.

Subscribes `applied_voltage` and `joint_states`; for each measured angle it publishes
`predicted_joint_states` with the same stamp, and `model_residual`, measured less predicted. The
prediction uses the applied voltage alone, never the measured angle, so that the residual shows the
model's error as it grows.

When the residual of settled states leaves the band of the model's own error, the last minutes are
diagnosed by another process at low priority; the diagnostics name the effect that the model lacks,
with its values and probability. ``~/diagnose`` asks for a diagnosis at once, ``~/save_recording``
writes what it is made of.

When the bridge's ``~/initialise`` has heated and cooled the muscle, call this node's ``~/reset``;
a model of the whole voltage range has its memory wiped by the cycle itself, as the muscle has.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses
import datetime
import math
import time as wall
from typing import Any, TYPE_CHECKING

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.task import Future
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.diagnosis.monitor import Monitor
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.kernels.warm_up import warm_up_observer
from hysteresis_ros.nodes.diagnostics import Diagnostics, WARN
from hysteresis_ros.nodes.parameters import GEOMETRY, MODEL, NAMES, Parameters, Spec
from hysteresis_ros.nodes.qos import MEASUREMENTS
from hysteresis_ros.nodes.reference import load_model, read_angle, seconds
from hysteresis_ros.nodes.running import run

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel

MONITORING = (
    Spec('residual_limit', 0.1, 'Difference between measurement and model that is reported as a '
         'warning', 'rad', 0.0, 3.2),
    Spec('residual_time', 10.0, 'Time that such a difference has to last: an arm on its way lags '
         'behind a model at rest', 's', 0.0, 600.0),
)

DIAGNOSIS = (
    Spec('diagnosis', True, 'Whether a residual that has left the band is diagnosed',
         read_only=True),
    Spec('diagnosis_window', 1800.0, 'Time that is judged at most, though at least 20 holds are',
         's', 60.0, 86400.0, read_only=True),
    Spec('diagnosis_share', 0.05, 'Share of a core that diagnoses may take on average', '', 0.001,
         1.0, read_only=True),
    Spec('settled_time', 20.0, 'Time that the voltage has to be held until the arm is settled',
         's', 20.0, 3600.0, read_only=True),
    Spec('recording_folder', '', 'Where ~/save_recording writes; empty for hysteresis_ros in '
         '$ROS_HOME or ~/.ros', read_only=True),
)
# Seconds of the wall between two looks at what the other process has computed.
LOOK_PERIOD = 0.25


class MonitorNode(Node):
    """
    The node `model_monitor`.

    Parameters
    ----------
    model : MuscleModel, optional
        Used instead of the one that the parameter ``model_file`` names.
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    # The prediction is built on the geometry once: here it is given at start only.
    PARAMETERS = MODEL + MONITORING + DIAGNOSIS + NAMES + tuple(
        dataclasses.replace(spec, read_only=True) for spec in GEOMETRY)

    def __init__(self, model: MuscleModel | None = None, **options: Any) -> None:
        super().__init__('model_monitor', **options)
        parameters = self._settings = Parameters(
            self, self.PARAMETERS, check=BicepGeometry.from_mapping)
        model = model or load_model(parameters['model_file'], parameters, self.get_logger())
        # Before anything is subscribed: the first sample must not wait for a compiler.
        self._ready_after = warm_up_observer(model)
        self.get_logger().info(f'kernels ready in {self._ready_after:.1f} s')
        self._observer = model.observer()
        self._monitor = Monitor(model, parameters['diagnosis_window'], parameters['settled_time'],
                                parameters['diagnosis_share'], wall.monotonic())
        self._voltage = self._ambient = self._residual = math.nan
        self._start: float | None = None
        self._time: float | None = None
        self._fine_until = math.nan
        self._measured = self._predicted = 0
        self._diagnostics = Diagnostics(
            self, parameters['hardware_id'], self._values, 'following the arm')
        self._prediction = self.create_publisher(
            JointState, 'predicted_joint_states', MEASUREMENTS)
        self._difference = self.create_publisher(Float64, 'model_residual', MEASUREMENTS)
        self.create_subscription(Float64, 'applied_voltage', self._on_voltage, MEASUREMENTS)
        self.create_subscription(
            JointState, 'joint_states', self._on_joint_states, MEASUREMENTS)
        self.create_subscription(
            Temperature, 'ambient_temperature', self._on_ambient, MEASUREMENTS)
        self.create_service(Trigger, '~/reset', self._on_reset)
        # A diagnosis takes seconds, in which all other callbacks go on.
        self.create_service(Trigger, '~/diagnose', self._on_diagnose,
                            callback_group=ReentrantCallbackGroup())
        self.create_service(Trigger, '~/save_recording', self._on_save)
        if parameters['diagnosis']:
            self.create_timer(LOOK_PERIOD, self._look, clock=Clock(
                clock_type=ClockType.STEADY_TIME))

    def on_shutdown(self) -> None:
        """End the process that diagnoses."""
        self._monitor.stop()

    def destroy_node(self) -> None:
        """End the process that diagnoses, however the node ends."""
        self._monitor.stop()
        super().destroy_node()

    def _forget(self) -> None:
        self._observer.reset()
        self._monitor.begin()
        self._start = self._time = None

    def _on_voltage(self, message: Float64) -> None:
        if math.isfinite(message.data):
            self._voltage = message.data

    def _on_ambient(self, message: Temperature) -> None:
        self._ambient = message.temperature

    def _on_joint_states(self, message: JointState) -> None:
        self._measured += 1
        angle = read_angle(message, self._settings['joint_name'])
        if angle is None or not math.isfinite(angle) or not math.isfinite(self._voltage):
            return
        time = seconds(message.header.stamp)
        if self._time is not None and time < self._time:
            self._diagnostics.set('clock', WARN, 'time went back: the prediction started again')
            self._forget()
        elif self._time is not None:
            self._diagnostics.clear('clock')
        if self._start is None:
            self._start = self._fine_until = time
        self._time = time
        predicted = self._observer.step(time - self._start, self._voltage, self._ambient)
        self._residual = angle - predicted
        output = JointState(name=[self._settings['joint_name']], position=[predicted])
        output.header.stamp = message.header.stamp
        self._prediction.publish(output)
        self._difference.publish(Float64(data=self._residual))
        self._predicted += 1
        self._judge(time)
        self._monitor.add(
            time - self._start, self._voltage, angle, predicted, self._ambient)

    def _look(self) -> None:
        if not self.context.ok():
            return
        monitor = self._monitor
        monitor.look(wall.monotonic())
        for name, sentence in (('diagnosis', monitor.sentence), ('diagnoses', monitor.problem)):
            if sentence:
                self._diagnostics.set(name, WARN, sentence)
            else:
                self._diagnostics.clear(name)

    def _judge(self, now: float) -> None:
        limit, time = self._settings['residual_limit'], self._settings['residual_time']
        if abs(self._residual) <= limit:
            self._fine_until = now
            # Half the limit: a residual near it is not to come and go with each sample.
            if abs(self._residual) <= 0.5 * limit:
                self._diagnostics.clear('residual', 'the arm is near the model again')
        elif now - self._fine_until >= time:
            self._diagnostics.set('residual', WARN, (
                f'the arm has been more than {limit:g} rad off the model for {time:g} s, now '
                f'{self._residual:+.3f} rad; call ~/diagnose, or record a run for `hysteresis '
                'diagnose`'))

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._forget()
        response.success = True
        response.message = 'memory wiped; the prediction starts from the cold arm'
        self.get_logger().info(response.message)
        return response

    async def _on_diagnose(self, request: Trigger.Request,
                           response: Trigger.Response) -> Trigger.Response:
        if not self._settings['diagnosis']:
            response.message = 'no diagnosis: the parameter diagnosis is false'
            return response
        future = Future()
        self._monitor.ask(lambda success, message: future.set_result((success, message)))
        response.success, response.message = await future
        self.get_logger().info(f'~/diagnose: {response.message}')
        return response

    def _on_save(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            path = self._monitor.save(self._settings['recording_folder'],
                                      datetime.datetime.now(datetime.timezone.utc))
        except (HysteresisError, OSError) as error:
            response.message = f'not saved: {" ".join(str(error).split())}'
            return response
        response.success, response.message = True, str(path)
        self.get_logger().info(f'~/save_recording: {path}')
        return response

    def _values(self) -> dict[str, Any]:
        return {'angles received': self._measured, 'angles predicted': self._predicted,
                'applied voltage [V]': self._voltage, 'residual [rad]': self._residual,
                'kernels ready after [s]': self._ready_after,
                **self._monitor.values(wall.monotonic())}


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(MonitorNode, args)
