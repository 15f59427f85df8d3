# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From what the muscle has to do to the voltage that makes it do so (Eqs. 12 to 14).

Subscribes `muscle_reference`, publishes `voltage_setpoint`. The node holds the memory of the two
hysteresis stages: each reference moves it once, in the order of arrival. While nothing new comes
the last setpoint is repeated, which does not move the memory, so that the watchdog behind
`voltage_setpoint` does not end a long hold.

When the diagnostics say that the bridge of the same arm has begun to heat and cool the muscle
(``~/initialise``), the memory is wiped, too, as by ``~/reset``. That also ends the repeating, so
nothing warms the muscle again between the cycle's end and the next reference.

A reference that names the muscle and gives no numbers lets it go: the setpoint is zero once, and
nothing is repeated until the next reference. So does the death of `geometry_node`, unless time is
simulated.

It is a managed node: configuring loads the model; deactivating lets the muscle go, and references
count again from when the node is active.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from hysteresis_ros.bicep.geometry import BicepGeometry, Reference
from hysteresis_ros.errors import HysteresisError, ParameterError, RangeError
from hysteresis_ros.kernels.warm_up import warm_up_controller
from hysteresis_ros.nodes.alive import ALIVE, listen_for_death, promise_life
from hysteresis_ros.nodes.diagnostics import Diagnostics, ERROR, OK, WARN
from hysteresis_ros.nodes.feedback import AngleFeedback
from hysteresis_ros.nodes.lifecycle import LIFECYCLE, ManagedNode
from hysteresis_ros.nodes.parameters import (
    check_limits, GEOMETRY, MODEL, NAMES, Parameters, Spec, TARGETS, VOLTAGE_LIMITS)
from hysteresis_ros.nodes.qos import COMMANDS, MEASUREMENTS
from hysteresis_ros.nodes.reference import (
    ArmReference, lets_go, load_model, needs_ambient, read_angle, read_reference, seconds)
from hysteresis_ros.nodes.running import run

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel

COMPENSATION = (
    Spec('republish_period', 0.5, 'Time after which the last setpoint is repeated; 0 for never',
         's', 0.0, 60.0),
    Spec('dead_band', 0.0, 'Reversals of the reference length up to this are not followed, '
         'because the inverse amplifies their noise', 'm', 0.0, 0.01),
    Spec('rate_limit', 0.0, 'Largest change of the setpoint a second; the rest of the way is done '
         'by the repeats. 0 for none', 'V/s', 0.0, 1000.0),
    Spec('horizon', 5.0, 'Time in which a muscle that the model knows to lag is to reach its '
         'temperature; it is overdriven meanwhile, within the limits. 0 for never overdriven, as '
         'without republish_period', 's', 0.0, 600.0),
    Spec('lag_margin', 0.3, "Share by which the muscle's time constant may differ from the "
         "model's; "
         'the larger, the later it comes, and the less can it go too far',
         '', 0.0, 0.9, read_only=True),
    Spec('feedback', False, 'Whether the measured angle corrects the setpoint slowly',
         read_only=True),
    Spec('feedback_gain', 0.1, 'Correction rate of the target angle per error', '1/s', 0.0, 10.0),
    Spec('feedback_limit', 0.15, 'Largest correction of the target angle', 'rad', 0.0, 1.0),
    Spec('feedback_rest_speed', 0.005, 'Speed above which the arm is on its way and the '
         'correction waits', 'rad/s', 0.0001, 10.0),
    Spec('feedback_dead_band', 0.003, 'Angle error that is not corrected', 'rad', 0.0, 1.0),
    Spec('feedback_period', 1.0, 'Time between two corrections', 's', 0.01, 60.0),
    Spec('feedback_delay', 10.0, 'Time after a new reference before the first correction', 's',
         0.0, 600.0),
)


class CompensatorNode(ManagedNode):
    """
    The node `hysteresis_compensator`.

    Parameters
    ----------
    model : MuscleModel, optional
        Used instead of the one that the parameter ``model_file`` names.
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    PARAMETERS = MODEL + VOLTAGE_LIMITS + COMPENSATION + TARGETS + GEOMETRY + NAMES + LIFECYCLE

    def __init__(self, model: MuscleModel | None = None, **options: Any) -> None:
        super().__init__('hysteresis_compensator', **options)
        self._settings = parameters = Parameters(
            self, self.PARAMETERS, check=_check, changed=self._configure)
        self._given = model
        # Both only where the node is configured.
        self._model: MuscleModel | None = None
        self._controller: Any = None
        self._integral = AngleFeedback()
        self._timer: Any = None
        self._ambients: Any = None
        self._works = False
        self._silent = True
        self._ambient = self._ready_after = math.nan
        self._received = self._published = self._refused = self._repeated = 0
        self._corrections = 0
        self._forget()
        self._publisher = self.create_publisher(Float64, 'voltage_setpoint', COMMANDS)
        self._diagnostics = Diagnostics(
            self, parameters['hardware_id'], self._counts, 'compensating')
        self._bridge = f"{self.get_namespace().strip('/')}/hardware_bridge".lstrip('/')
        self._initialising = False
        if parameters['autostart']:
            self.start()
        else:
            self._tell_state('unconfigured')
        self.create_subscription(JointState, 'muscle_reference', self._on_reference, COMMANDS)
        if parameters['feedback']:
            self.create_subscription(
                JointState, 'joint_states', self._on_joint_states, MEASUREMENTS)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, 10)
        self.create_service(Trigger, '~/reset', self._on_reset)
        listen_for_death(self, f'bicep_geometry/{ALIVE}', self._on_death)
        promise_life(self)

    def set_up(self) -> None:
        """Load the model and compile what runs on it."""
        parameters = self._settings
        self._model = self._given or load_model(
            parameters['model_file'], parameters, self.get_logger())
        # Before anything is followed: the first reference must not wait for a compiler.
        self._ready_after = warm_up_controller(self._model)
        self.get_logger().info(f'kernels ready in {self._ready_after:.1f} s')
        self._controller = self._model.controller(
            arm=True, lag_margin=parameters['lag_margin'])
        if needs_ambient(self._model):
            self._ambients = self.create_subscription(
                Temperature, 'ambient_temperature', self._on_ambient, MEASUREMENTS)
        self._configure(parameters)
        self._tell_state('inactive')

    def activate(self) -> None:
        """Follow references from now on."""
        self._works = True
        self._tell_state('')

    def deactivate(self) -> None:
        """Let the muscle go, and follow nothing."""
        self._let_go()
        self._works = False
        self._tell_state('inactive')

    def clean_up(self) -> None:
        """Forget the model."""
        if self._works and self.context.ok():
            self._let_go()
        self._works = False
        self._repeat_every(0.0)
        if self._ambients is not None:
            self.destroy_subscription(self._ambients)
            self._ambients = None
        self._model = self._controller = None
        self._tell_state('unconfigured')

    def _tell_state(self, state: str) -> None:
        if not self.context.ok():
            return
        if state:
            self._diagnostics.set('lifecycle', OK, f'the node is {state}')
        else:
            self._diagnostics.clear('lifecycle', 'active: following references')

    def _repeat_every(self, period: float) -> None:
        """Look for silence twice in a period [s]; 0 for never."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None
        if period > 0.0:
            self._timer = self.create_timer(0.5 * period, self._repeat)

    def _configure(self, parameters: Parameters) -> None:
        self._muscle, self._joint = parameters['muscle_name'], parameters['joint_name']
        self._feedback = parameters['feedback']
        if self._model is None:
            return
        self._geometry = BicepGeometry.from_mapping(parameters)
        self._arm = ArmReference(self._geometry, self._model, parameters['target_dead_band'])
        self._controller.limits = parameters['minimum_voltage'], parameters['maximum_voltage']
        self._controller.dead_band = parameters['dead_band']
        self._controller.rate_limit = parameters['rate_limit'] or math.inf
        # Whoever overdrives has to come back: that is done by the repeats.
        repeated = parameters['republish_period'] > 0.0
        self._controller.horizon = (parameters['horizon'] if repeated else 0.0) or math.inf
        self._integral.configure(*(parameters[f'feedback_{name}'] for name in (
            'gain', 'limit', 'rest_speed', 'dead_band', 'period', 'delay')))
        self._repeat_every(parameters['republish_period'])

    def _forget(self) -> None:
        self._wanted: Reference | None = None
        self._target = math.nan
        self._saturated = 0
        self._integral.reset()

    def _now(self) -> float:
        return 1e-9 * self.get_clock().now().nanoseconds

    def _on_reference(self, message: JointState) -> None:
        if not self._works:
            return
        self._received += 1
        if lets_go(message, self._muscle):
            self._let_go()
            return
        try:
            wanted = read_reference(message, self._muscle)
            target = self._arm.angle(wanted.length) if self._feedback else math.nan
        except RangeError as error:
            self._refused += 1
            self._diagnostics.set('reference', WARN, f'reference not followed: {error}')
            return
        self._diagnostics.clear('reference')
        self._diagnostics.clear('geometry')
        self._wanted, self._target = wanted, target
        if self._feedback:
            self._integral.begin(self._now())
        self._published += self._apply(self._corrected(wanted))

    def _let_go(self) -> None:
        """Switch the muscle off: without a drive it cools, and forgets what is above zero."""
        self._reset()
        self._publish(0.0)

    def _on_death(self) -> None:
        # In simulated time nothing burns, and a busy machine must not spoil the run.
        if self._wanted is None or self.get_parameter('use_sim_time').value:
            return
        self._let_go()
        self._diagnostics.set('geometry', ERROR, 'the geometry node has died or hangs: the muscle '
                              'is switched off until the next reference')

    def _corrected(self, wanted: Reference) -> Reference:
        """Return the reference with the feedback's correction of the angle."""
        correction = self._integral.correction
        if correction == 0.0:
            return wanted
        # The change that the geometry alone gives for a small turn; everything else stays.
        low, high = self._geometry.angle_range
        before = float(self._geometry.angle(wanted.length))
        after = min(max(before + correction, low), high)
        force = self._geometry.force(after) - self._geometry.force(before)
        return Reference(float(self._geometry.length(after)), float(wanted.force + force))

    def _apply(self, reference: Reference) -> bool:
        """Publish the voltage for a reference and return whether there was one."""
        try:
            setpoint = self._controller.setpoint(
                reference.length, reference.force, self._now(), ambient=self._ambient)
            if not math.isfinite(setpoint.voltage):
                raise RangeError(f'the model has no voltage for {reference}')
        except HysteresisError as error:
            self._refused += 1
            self._diagnostics.set('setpoint', ERROR, f'no setpoint: {error}')
            return False
        self._diagnostics.clear('setpoint')
        self._publish(setpoint.voltage)
        if setpoint.saturated:
            # Expected too short: a larger angle is still possible, a smaller one is not.
            self._saturated = -1 if setpoint.error > 0.0 else 1
            self._diagnostics.set('saturated', WARN, (
                f'saturated: {setpoint.reason} (error {1e3 * setpoint.error:+.3f} mm)'))
        else:
            self._saturated = 0
            self._diagnostics.clear('saturated')
        return True

    def _publish(self, voltage: float) -> None:
        self._publisher.publish(Float64(data=voltage))
        self._silent = False

    def _repeat(self) -> None:
        """Publish when there was silence since the last look, half a period ago."""
        if self._works and self._silent and self._wanted is not None:
            self._publish(self._controller.hold(self._now(), self._ambient))
            self._repeated += 1
        else:
            self._silent = True

    def _on_joint_states(self, message: JointState) -> None:
        angle = read_angle(message, self._joint)
        if not self._works or self._wanted is None or angle is None:
            return
        before = self._integral.correction
        correction = self._integral.update(
            seconds(message.header.stamp), angle, self._target, self._saturated)
        if correction != before:
            self._corrections += self._apply(self._corrected(self._wanted))

    def _on_ambient(self, message: Temperature) -> None:
        self._ambient = message.temperature

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        """Forget when the bridge of the same arm begins its heat and cool cycle."""
        for status in message.status:
            if status.name != self._bridge:
                continue
            state = next((value.value for value in status.values if value.key == 'state'), '')
            if state == 'initialising' and not self._initialising:
                self._reset()
                self.get_logger().info('the bridge heats and cools the muscle: memory wiped')
            self._initialising = state == 'initialising'

    def _reset(self) -> None:
        if self._controller is not None:
            self._controller.reset()
        self._forget()
        self._diagnostics.clear('saturated')

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._reset()
        response.success = True
        response.message = 'memory wiped; the setpoint is repeated again from the next reference'
        self.get_logger().info(response.message)
        return response

    def _counts(self) -> dict[str, Any]:
        return {'lifecycle': self.state, 'references received': self._received,
                'setpoints published': self._published,
                'references refused': self._refused, 'setpoints repeated': self._repeated,
                'feedback corrections': self._corrections,
                'feedback correction [rad]': self._integral.correction,
                'kernels ready after [s]': self._ready_after}


def _check(values: Mapping[str, Any]) -> None:
    check_limits(values, 'voltage')
    BicepGeometry.from_mapping(values)
    horizon, period = values['horizon'], values['republish_period']
    if 0.0 < horizon < period:
        raise ParameterError(f'republish_period {period:g} s is longer than the horizon of '
                             f'{horizon:g} s; a muscle would be overdriven for too long')
    if values['rate_limit'] > 0.0 and period == 0.0:
        raise ParameterError('rate_limit needs the repeats, which do the rest of the way: give '
                             'republish_period')


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(CompensatorNode, args)
