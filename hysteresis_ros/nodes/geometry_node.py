# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the arm's target angle to what each muscle has to do: length and force (Eqs. 21 and 22).

Subscribes `target_angle`, publishes `muscle_reference`. A target that is not finite, outside the
limits or out of the linkage's reach is not passed on: the last good reference stays in force, and
log and diagnostics say why. With a model file, the effects of the arm and of its encoder that the
model knows are undone here, the muscle's own in `compensator_node`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import dataclasses
import math
from typing import Any, TYPE_CHECKING

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.errors import RangeError
from hysteresis_ros.nodes.diagnostics import Diagnostics, WARN
from hysteresis_ros.nodes.parameters import (
    ANGLE_LIMITS, check_limits, GEOMETRY, MODEL, NAMES, Parameters, TARGETS)
from hysteresis_ros.nodes.qos import COMMANDS
from hysteresis_ros.nodes.reference import ArmReference, load_model
from hysteresis_ros.nodes.running import run

if TYPE_CHECKING:
    from hysteresis_ros.model import MuscleModel


class GeometryNode(Node):
    """
    The node `bicep_geometry`.

    Parameters
    ----------
    model : MuscleModel, optional
        Used instead of the one that the parameter ``model_file`` names.
    **options
        For `rclpy.node.Node`, such as ``namespace`` or ``parameter_overrides``.
    """

    PARAMETERS = GEOMETRY + ANGLE_LIMITS + TARGETS + MODEL + NAMES

    def __init__(self, model: MuscleModel | None = None, **options: Any) -> None:
        super().__init__('bicep_geometry', **options)
        parameters = Parameters(
            self, self.PARAMETERS, check=_check, changed=self._configure)
        if model is None and parameters['model_file']:
            model = load_model(parameters['model_file'], parameters, self.get_logger())
        self._model = model
        self._configure(parameters)
        self._received = self._published = self._refused = 0
        self._diagnostics = Diagnostics(
            self, parameters['hardware_id'], self._counts, 'passing targets on')
        self._publisher = self.create_publisher(JointState, 'muscle_reference', COMMANDS)
        self.create_subscription(Float64, 'target_angle', self._on_target, COMMANDS)

    def _configure(self, parameters: Parameters) -> None:
        self._limits = parameters['minimum_angle'], parameters['maximum_angle']
        self._muscle = parameters['muscle_name']
        geometry = BicepGeometry.from_mapping(parameters)
        if self._model is not None:
            self._model = dataclasses.replace(self._model, geometry=geometry)
        self._reference = ArmReference(
            geometry, self._model, parameters['target_dead_band']).reference

    def _on_target(self, message: Float64) -> None:
        self._received += 1
        try:
            self._check_target(message.data)
            reference = self._reference(message.data)
        except RangeError as error:
            self._refused += 1
            self._diagnostics.set('target', WARN, f'target not passed on: {error}')
            return
        output = JointState(
            name=[self._muscle], position=[reference.length], effort=[reference.force])
        output.header.stamp = self.get_clock().now().to_msg()
        self._publisher.publish(output)
        self._published += 1
        self._diagnostics.clear('target')

    def _check_target(self, angle: float) -> None:
        low, high = self._limits
        if math.isfinite(angle) and not low <= angle <= high:
            raise RangeError(
                f'target angle {angle:.4f} rad is outside the limits of {low:.4f} to '
                f'{high:.4f} rad ({math.degrees(low):.1f} to {math.degrees(high):.1f} deg)')

    def _counts(self) -> dict[str, Any]:
        return {'targets received': self._received, 'references published': self._published,
                'targets refused': self._refused}


def _check(values: Mapping[str, Any]) -> None:
    check_limits(values, 'angle')
    BicepGeometry.from_mapping(values)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node."""
    return run(GeometryNode, args)
