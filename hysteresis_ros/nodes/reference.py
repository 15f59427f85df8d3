# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes take from the model file and from the geometry in their parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

from sensor_msgs.msg import JointState

from hysteresis_ros.bicep.geometry import BicepGeometry, Reference
from hysteresis_ros.errors import ModelFileError, ParameterError, RangeError
from hysteresis_ros.share import share_path

if TYPE_CHECKING:
    from builtin_interfaces.msg import Time
    from rclpy.impl.rcutils_logger import RcutilsLogger

    from hysteresis_ros.model import MuscleModel

# The model's effects move an angle by a few degrees; each pass leaves a few percent of that.
PASSES = 6
# Where the effects sit that are undone before the muscle's reference; the others come after it.
STAGES = ('mechanism', 'sensor')


def load_model(path: str, values: Mapping, logger: RcutilsLogger) -> MuscleModel:
    """
    Load a model and give it the arm that the node's parameters describe.

    Parameters
    ----------
    path : str
        Model file; empty for the one that comes with the package.
    values : mapping
        The node's parameters, with the geometry.
    logger : rclpy logger
        Told which model it is, and warned if it was identified with another arm.

    Returns
    -------
    MuscleModel

    Raises
    ------
    ModelFileError
        If it cannot be read, is no model file of this version, or not of a muscle that lifts an arm
        by voltage.
    """
    from hysteresis_ros.model import MuscleModel   # SciPy: not needed without a model
    from hysteresis_ros.model.loads import check_lengths
    path = path or str(share_path('config/bicep_model.yaml'))
    try:
        model = MuscleModel.load(path)
    except OSError as error:
        raise ModelFileError(f'model_file: {path} cannot be read ({error.strerror})') from None
    if model.drive != 'voltage' or model.length_stage is None:
        raise ModelFileError(f'{path}: the nodes need a model from voltage to length; identify one '
                             'with --length')
    geometry = BicepGeometry.from_mapping(values)
    others = [] if model.geometry is None else [
        f'{name} {other:g} instead of {getattr(geometry, name):g}'
        for name, other in model.geometry.to_mapping().items()
        if abs(other - getattr(geometry, name)) > 1e-9]
    if others:
        logger.warning(f'{path} is of another arm ({", ".join(others)}); the parameters count')
    effects = ', '.join(effect.id for effect in model.effects) or 'no effects'
    logger.info(f'model: {path} with {effects}')
    model = dataclasses.replace(model, geometry=geometry)
    try:
        check_lengths(model)
    except ParameterError as error:
        raise ModelFileError(f'{path}: {error}') from None
    return model


def needs_ambient(model: MuscleModel) -> bool:
    """Whether an effect of the model asks for the recorded ambient temperature."""
    return any(effect.needs_column == 'ambient_temperature' for effect in model.effects)


class ArmReference:
    """
    Between the arm's angle and what each muscle has to do.

    Parameters
    ----------
    geometry : BicepGeometry
        The arm.
    model : MuscleModel, optional
        Its effects of the arm and of the sensor are undone; none without it.
    dead_band : float
        Turn of the target [rad] up to which friction and backlash are not undone anew.
    """

    def __init__(self, geometry: BicepGeometry, model: MuscleModel | None = None,
                 dead_band: float = 0.0) -> None:
        self._geometry = geometry
        if model is None or not any(effect.stage in STAGES for effect in model.effects):
            self.reference = self._probe = geometry.reference
        else:
            self.reference = model.controller(angle_dead_band=dead_band).reference
            # Friction makes a reference depend on the one before, so a search needs its own.
            self._probe = model.controller(angle_dead_band=dead_band).reference

    def angle(self, length: float) -> float:
        """
        Angle [rad] for which `reference` gives the elongation `length` [m].

        Raises
        ------
        RangeError
            If the linkage cannot take it.
        """
        wanted = float(self._geometry.angle(length))
        theta = wanted
        for _ in range(PASSES):
            theta += wanted - float(self._geometry.angle(self._probe(theta).length))
        return theta


def let_go(muscle: str) -> JointState:
    """Return the reference that asks nothing of a muscle: its name alone, without numbers."""
    return JointState(name=[muscle])


def lets_go(message: JointState, muscle: str) -> bool:
    """Whether a reference asks nothing of this muscle, so that it is to be switched off."""
    return list(message.name) == [muscle] and not message.position and not message.effort


def read_reference(message: JointState, muscle: str) -> Reference:
    """
    Take one muscle's reference out of a `sensor_msgs.msg.JointState`.

    Parameters
    ----------
    message : JointState
        Elongation [m] as position, force [N] as effort.
    muscle : str
        Name of the muscle.

    Raises
    ------
    RangeError
        If the message does not hold both numbers for this muscle, or they are not finite.
    """
    if muscle not in message.name:
        raise RangeError(f'muscle_reference names {list(message.name)}, not {muscle!r}')
    index = message.name.index(muscle)
    if len(message.position) <= index or len(message.effort) <= index:
        raise RangeError('muscle_reference lacks position (length) or effort (force)')
    reference = Reference(message.position[index], message.effort[index])
    if not all(abs(value) < float('inf') for value in reference):
        raise RangeError(f'muscle_reference asks for {reference.length} m under '
                         f'{reference.force} N; both have to be finite')
    return reference


def read_angle(message: JointState, joint: str) -> float | None:
    """Take one joint's angle [rad] out of a `JointState`; None if the message has none."""
    if joint not in message.name:
        return None
    index = message.name.index(joint)
    return message.position[index] if index < len(message.position) else None


def seconds(stamp: Time) -> float:
    """Return a `builtin_interfaces.msg.Time` in seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec
