# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The robotic bicep's dimensions, and how the forearm's angle, the wires and the weights relate.

The upper ends of the wires (D) are straight above the pivot (A), the lower ends at the clamp (C) on
the forearm. The angle theta lies between the forearm and the upward vertical, so a wire that
contracts lowers it.
"""

import dataclasses
import math

# Our own choice: the paper gives neither x, a nor y. With them a clean arm moves over about 47.5
# degrees between no voltage and 6 V, each wire pulling with 5.0 to 6.6 N.
GEOMETRY = {
    'clamp_distance': 0.017,
    'clamp_height': 0.006,
    'anchor_height': 0.2655,
    'forearm_length': 0.30,
    'resting_length': 0.27,
    'payload_mass': 0.100,
    'forearm_mass': 0.040,
    'muscle_count': 3,
    'gravity': 9.81,
}

# The arm's mechanics end here [rad], short of the dead centres.
LOWEST_ANGLE, HIGHEST_ANGLE = math.radians(50.0), math.radians(192.0)


@dataclasses.dataclass(frozen=True)
class Linkage:
    """
    The arm as it really is, which need not be what its data sheet says.

    Parameters
    ----------
    clamp_distance, clamp_height, anchor_height, forearm_length : float
        Where the wires are fixed, and the forearm's length [m].
    resting_length : float
        Length of a wire at rest [m].
    payload_mass, forearm_mass : float
        Weight at the forearm's end and the forearm's own mass [kg].
    muscle_count : int
        Number of wires.
    gravity : float
        Acceleration [m/s^2].
    clamp_mass, clamp_radius, clamp_phase : float
        Mass of the clamp [kg], its distance from the pivot [m] and its direction against the
        forearm [rad].
    tilt : float
        Angle by which the frame leans, so that gravity acts at theta + tilt [rad].
    """

    clamp_distance: float = GEOMETRY['clamp_distance']
    clamp_height: float = GEOMETRY['clamp_height']
    anchor_height: float = GEOMETRY['anchor_height']
    forearm_length: float = GEOMETRY['forearm_length']
    resting_length: float = GEOMETRY['resting_length']
    payload_mass: float = GEOMETRY['payload_mass']
    forearm_mass: float = GEOMETRY['forearm_mass']
    muscle_count: int = int(GEOMETRY['muscle_count'])
    gravity: float = GEOMETRY['gravity']
    clamp_mass: float = 0.0
    clamp_radius: float = 0.0
    clamp_phase: float = 0.0
    tilt: float = 0.0
    _lead: float = dataclasses.field(init=False, repr=False)
    _squares: float = dataclasses.field(init=False, repr=False)
    _product: float = dataclasses.field(init=False, repr=False)
    _weight: float = dataclasses.field(init=False, repr=False)

    def __post_init__(self) -> None:
        radius = math.hypot(self.clamp_distance, self.clamp_height)
        set_once = object.__setattr__
        set_once(self, '_lead', math.atan2(self.clamp_height, self.clamp_distance))
        set_once(self, '_squares', radius ** 2 + self.anchor_height ** 2)
        set_once(self, '_product', radius * self.anchor_height)
        set_once(self, '_weight', self.gravity * self.forearm_length * (
            self.payload_mass + 0.5 * self.forearm_mass))

    def elongation(self, theta: float) -> float:
        """Return the distance from anchor to clamp less the resting length [m]."""
        return math.sqrt(self._squares - 2.0 * self._product * math.cos(
            theta - self._lead)) - self.resting_length

    def moment_arm(self, theta: float) -> float:
        """Return the distance of the wires' line from the pivot [m], dz/dtheta."""
        turned = theta - self._lead
        return self._product * math.sin(turned) / math.sqrt(
            self._squares - 2.0 * self._product * math.cos(turned))

    def moment(self, theta: float) -> float:
        """Return the moment of all weights that the wires have to hold [N m]."""
        return self._weight * math.sin(theta + self.tilt) + (
            self.clamp_mass * self.gravity * self.clamp_radius
            * math.sin(theta + self.clamp_phase + self.tilt))
