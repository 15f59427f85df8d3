# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Quasi-static geometry of the bicep: angle to muscle length and force, and back.

Equations 16 to 22 of Zhang, Simeonov and Yip with two misprints put right: the elongation is
``L = z - z0`` (the printed sign disagrees with the rest of the paper), and in Eq. 19 the arc cosine
is taken of the whole fraction.
"""

import dataclasses
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
import yaml

from hysteresis_ros.bicep.geometry_units import in_si
from hysteresis_ros.errors import ParameterError, RangeError

# The arm is left this much short of the two dead centres, where the moment arm vanishes.
DEAD_CENTRE_MARGIN = math.radians(1.0)


class Reference(NamedTuple):
    """What one muscle has to do: elongation `length` [m] under tension `force` [N]."""

    length: float
    force: float


@dataclasses.dataclass(frozen=True)
class BicepGeometry:
    """
    One-link arm lifted by parallel muscles (Fig. 5).

    The angle theta [rad] lies between the forearm and the upward vertical; a contracting muscle
    lowers it. Angles may be scalars or arrays of any shape; what is returned has the same shape.

    Parameters
    ----------
    clamp_distance : float
        Distance x from the pivot to the clamp along the forearm [m].
    clamp_height : float
        Height a of the clamp above the forearm [m].
    anchor_height : float
        Height y of the upper end of the muscles above the pivot [m].
    forearm_length : float
        Length l of the forearm [m]; the payload hangs from its end.
    resting_length : float
        Resting length z0 of a muscle [m].
    payload_mass, forearm_mass : float
        Masses [kg]; the forearm's centre lies in its middle.
    muscle_count : int
        Number of equal muscles that share the load.
    gravity : float
        Acceleration [m/s^2].

    Raises
    ------
    ParameterError
        If a value is not finite or not positive where it has to be.
    """

    clamp_distance: float
    clamp_height: float
    anchor_height: float
    forearm_length: float
    resting_length: float
    payload_mass: float
    forearm_mass: float
    muscle_count: int = 3
    gravity: float = 9.81

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
                raise ParameterError(f'geometry: {field.name} must be a number, not {value!r}')
            if not math.isfinite(value):
                raise ParameterError(f'geometry: {field.name} must be finite, not {value!r}')
            free = field.name in ('clamp_height', 'payload_mass', 'forearm_mass')
            if value < 0.0 or (value == 0.0 and not free):
                bound = 'not negative' if free else 'positive'
                raise ParameterError(f'geometry: {field.name} must be {bound}, not {value!r}')
        if self.muscle_count != int(self.muscle_count):
            raise ParameterError(
                f'geometry: muscle_count must be a whole number, not {self.muscle_count!r}')

    @property
    def moved_mass(self) -> float:
        """Mass of payload and forearm [kg]."""
        return self.payload_mass + self.forearm_mass

    @property
    def largest_moment(self) -> float:
        """Moment of gravity on the level forearm [N m]."""
        return self.gravity * self.forearm_length * (self.payload_mass + self.forearm_mass / 2.0)

    @property
    def moment_of_inertia(self) -> float:
        """Moment of inertia of payload and forearm about the pivot [kg m^2]."""
        return self.forearm_length ** 2 * (self.payload_mass + self.forearm_mass / 3.0)

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any], source: str = 'geometry') -> 'BicepGeometry':
        """
        Build from a mapping with the field names as keys; keys it does not know are ignored.

        Raises
        ------
        ParameterError
            If a key is missing or a value makes no sense; the message names `source`.
        """
        names = [field.name for field in dataclasses.fields(cls)]
        required = [field.name for field in dataclasses.fields(cls)
                    if field.default is dataclasses.MISSING]
        missing = [name for name in required if name not in mapping]
        if missing:
            raise ParameterError(f'{source}: geometry lacks {", ".join(missing)}')
        try:
            return cls(**{name: mapping[name] for name in names if name in mapping})
        except ParameterError as error:
            raise ParameterError(f'{source}: {error}') from None

    @classmethod
    def from_written(cls, mapping: Mapping[str, Any],
                     source: str = 'geometry') -> 'BicepGeometry':
        """
        Build from values that a person has written, with a look at their units.

        They are in m, kg and m/s^2, or text with a unit, such as ``17 mm``.

        Raises
        ------
        ParameterError
            As `from_mapping`, and for values that no arm has, which another unit explains.
        """
        try:
            converted = in_si(mapping)
        except ParameterError as error:
            raise ParameterError(f'{source}: {error}') from None
        return cls.from_mapping(converted, source)

    @classmethod
    def from_yaml(cls, path: str | os.PathLike[str]) -> 'BicepGeometry':
        """
        Read a plain YAML mapping, or a ROS 2 parameter file with ``ros__parameters``.

        Raises
        ------
        ParameterError
            If the file is no such mapping, and as `from_written`.
        """
        try:
            content = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            first = str(error).splitlines()[0]
            raise ParameterError(f'{path}: not a YAML file ({first})') from None
        if not isinstance(content, Mapping):
            raise ParameterError(f'{path}: expected a mapping of geometry names to numbers')
        for section in content.values():
            if isinstance(section, Mapping) and isinstance(
                    section.get('ros__parameters'), Mapping):
                content = section['ros__parameters']
                break
        return cls.from_written(content, source=str(path))

    def to_mapping(self) -> dict[str, float]:
        """Return the fields as plain numbers, ready for YAML."""
        return {name: int(value) if name == 'muscle_count' else float(value)
                for name, value in dataclasses.asdict(self).items()}

    @property
    def clamp_radius(self) -> float:
        """Distance c from the pivot to the clamp [m] (Eq. 17)."""
        return math.hypot(self.clamp_height, self.clamp_distance)

    @property
    def clamp_angle(self) -> float:
        """Angle gamma between that line and the forearm [rad] (Eq. 17)."""
        return math.atan2(self.clamp_height, self.clamp_distance)

    def muscle_length(self, theta: ArrayLike) -> Any:
        """Length z of the muscle [m] at the angle `theta` [rad] (law of cosines in Eq. 18)."""
        c, y = self.clamp_radius, self.anchor_height
        kappa = np.asarray(theta) - self.clamp_angle
        return np.sqrt(c * c + y * y - 2.0 * c * y * np.cos(kappa))

    def length(self, theta: ArrayLike) -> Any:
        """Elongation ``L = z - z0`` [m] at the angle `theta` [rad] (Eq. 21, sign put right)."""
        return self.muscle_length(theta) - self.resting_length

    def moment_arm(self, theta: ArrayLike) -> Any:
        """
        Distance r [m] from the pivot to the muscle's line of action.

        ``r = y sin(delta)`` with delta of Eq. 19; by the law of sines it is also
        ``c y sin(theta - gamma) / z = dz/dtheta``, which keeps its sign beyond a dead centre.
        """
        kappa = np.asarray(theta) - self.clamp_angle
        return (self.clamp_radius * self.anchor_height * np.sin(kappa)
                / self.muscle_length(theta))

    def point(self, theta: float, along: float, above: float = 0.0
              ) -> tuple[float, float, float]:
        """
        Return where a point of the forearm is at the angle `theta` [rad].

        Parameters
        ----------
        theta : float
            Angle [rad].
        along, above : float
            Distance from the pivot along the forearm, and above the forearm [m].

        Returns
        -------
        tuple of float
            x (forward), y (left) and z (up) from the pivot [m].
        """
        sine, cosine = math.sin(theta), math.cos(theta)
        return along * sine - above * cosine, 0.0, along * cosine + above * sine

    def load_moment(self, theta: ArrayLike) -> Any:
        """Moment of payload and forearm about the pivot [N m] (right side of Eq. 16)."""
        mass_length = (self.payload_mass + 0.5 * self.forearm_mass) * self.forearm_length
        return mass_length * self.gravity * np.sin(theta)

    def force(self, theta: ArrayLike) -> Any:
        """Tension of each muscle [N] that holds the arm at the angle `theta` [rad] (Eq. 22)."""
        return self.load_moment(theta) / (self.muscle_count * self.moment_arm(theta))

    def angle(self, length: ArrayLike) -> Any:
        """
        Angle [rad] at which the muscle's elongation is `length` [m]: the inverse of `length`.

        Lengths outside what the linkage allows give NaN.
        """
        c, y = self.clamp_radius, self.anchor_height
        z = np.asarray(length) + self.resting_length
        with np.errstate(invalid='ignore'):
            return self.clamp_angle + np.arccos((c * c + y * y - z * z) / (2.0 * c * y))

    @property
    def angle_range(self) -> tuple[float, float]:
        """Angles [rad] between the dead centres where the load pulls on the muscle."""
        low = max(self.clamp_angle, 0.0) + DEAD_CENTRE_MARGIN
        high = min(self.clamp_angle + math.pi, math.pi) - DEAD_CENTRE_MARGIN
        return low, high

    def check_angle(self, theta: float) -> None:
        """
        Refuse an angle [rad] that the linkage cannot take.

        Raises
        ------
        RangeError
            If `theta` is not finite or outside `angle_range`; the message gives the range.
        """
        low, high = self.angle_range
        if not math.isfinite(theta):
            raise RangeError(f'target angle is {theta}; it has to be a finite number in rad')
        if not low <= theta <= high:
            raise RangeError(
                f"target angle {theta:.4f} rad is outside the linkage's range of "
                f'{low:.4f} to {high:.4f} rad ({math.degrees(low):.1f} to '
                f'{math.degrees(high):.1f} deg)')

    def reference(self, theta: float) -> Reference:
        """
        Elongation and force that hold the arm at `theta` [rad] (Eqs. 21 and 22).

        Raises
        ------
        RangeError
            If the linkage cannot take the angle.
        """
        self.check_angle(theta)
        return Reference(float(self.length(theta)), float(self.force(theta)))
