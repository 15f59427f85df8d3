# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What an effect can be, by the stage at which it acts: drive, material, mechanism or sensor."""

import dataclasses
import math
from typing import ClassVar

import numpy as np

from hysteresis_ros.bicep.geometry import BicepGeometry
from hysteresis_ros.effects.base import Effect, Inputs, Surroundings, Values


class DriveEffect(Effect):
    """
    Effect between the drive that was set and the steady-state drive that the muscle feels.

    An electrical effect maps the drive, a thermal one the drive squared (the drive itself where it
    is a temperature, pressure or power). One without a past defines `forward`, one with a past
    `step` and `start`; the other follows.
    """

    # The product of `exchange` of all thermal effects; the chain sets it in each of them.
    speed: float
    # Heat exchange with the air over that of the bench, which every lag of the model follows.
    exchange: float = 1.0

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """
        Map the signal of one trial.

        Parameters
        ----------
        signal : ndarray, shape (rows,)
            Drive or drive squared; an effect without a past takes a scalar as well.
        inputs : Inputs
            Of the same shape.
        surroundings : Surroundings
            The muscle.

        Returns
        -------
        ndarray, shape (rows,)
        """
        self.start()
        times = np.broadcast_to(inputs.dt, np.shape(signal)).tolist()
        phases = np.broadcast_to(inputs.phase, np.shape(signal)).tolist()
        return np.array([self.step(value, dt, phase, surroundings)
                         for value, dt, phase in zip(signal.tolist(), times, phases)])

    def step(self, value: float, dt: float, phase: float, surroundings: Surroundings) -> float:
        """Advance by `dt` [s] under the constant input `value`; `phase` as in `Inputs`."""
        inputs = Inputs(0.0, 0.0, dt, math.nan, phase, 0.0)
        return float(self.forward(value, inputs, surroundings))

    def inverse(self, signal: float, inputs: Inputs, surroundings: Surroundings) -> float:
        """
        Return the input for which the output becomes `signal`; identity if not possible.

        For an effect with a past: the input that, held for ``inputs.dt`` seconds, brings the
        output there.
        """
        return signal


class MaterialEffect(Effect):
    """
    Effect on the muscle's relation ``L = L0 + S(F) f (H2[s (x - c F)] - L0) + e(F) + o``.

    The transformation is H2 of the drive x shifted by the load F; S scales its strain, e is what
    the load alone stretches, f and o are what time and use do. The loop may be wider by w(F) than
    that of H2: see `kernels.load_play`. Martensite may keep a share of its strain, whatever the
    load: see `kernels.formation`. Each method has a neutral default. Loads are per muscle,
    scalars or arrays.
    """

    stage = 'material'
    # Load per drive squared that takes the place of the first stage; 0 leaves it as it is.
    load_per_drive_squared: float = 0.0
    # Share, 0 to 1, by which the shift by the load is in proportion to `strain_of_bench`.
    follows_strain: float = 0.0
    # Share, 0 to 1, of its strain that martensite keeps from the load under which it formed.
    keeps_strain: float = 0.0
    # Whether a load heavier than that one orients it anew.
    oriented_anew: bool = False
    # Whether the martensite that a trial begins with formed while the arm cooled down; else under
    # the load at rest.
    cooled_on_arm: bool = True
    # Share, 0 to 1, of the transformation whose minor loops are scaled from the major one.
    kinetics: float = 0.0
    # Share, 0 to 1, of what a load has left twinned that each branch of these orients anew.
    orients_anew: float = 0.0
    # Excess length [m] of each parallel muscle.
    offsets: tuple[float, ...] = (0.0,)
    # Parts of the wire that are not equally warm, and the excess of each over that of the wire on
    # the bench, each shape (K,); None: all of it is as warm as that.
    places: tuple[np.ndarray, np.ndarray] | None = None

    def yields(self, surroundings: Surroundings) -> tuple[float, float]:
        """Return the load [N] from which a muscle yields for good, and by how much then [m/N]."""
        return math.inf, 0.0

    def on_drive(self) -> DriveEffect | None:
        """Return what it does to the drive squared that the muscle feels, None if nothing."""
        return None

    def shift_load(self, load: Values, surroundings: Surroundings) -> Values:
        """Return what is added to the load inside the transformation, in units of the load."""
        return 0.0 * load

    def loop_width(self, load: Values, surroundings: Surroundings) -> Values:
        """Return w, by which the loop is wider than that of H2, in units of the load."""
        return 0.0 * load

    def scale(self, load: Values, surroundings: Surroundings) -> Values:
        """Return S, the factor on the transformation strain under `load`."""
        return 1.0 + 0.0 * load

    def elastic_share(self, surroundings: Surroundings) -> float:
        """Return the share of the stroke under the mean load that grows in proportion to a load."""
        return 0.0

    def strain_of_bench(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the bench's transformation strain under a load over that under the mean load."""
        return 1.0 + 0.0 * load

    def oriented(self, load: Values, surroundings: Surroundings) -> Values:
        """Return the share of what forms that a load orients, the rest of which is twinned."""
        return 1.0 + 0.0 * load

    def stretch(self, load: Values, surroundings: Surroundings) -> Values:
        """Return e, the elongation under `load` that does not depend on the transformation."""
        return 0.0 * load

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """
        Return what time and history add in one trial.

        Parameters
        ----------
        drive, drive_squared : ndarray, shape (rows,)
            The drive that was set, and the drive squared that the muscle feels.
        inputs : Inputs
            Of the same shape.
        surroundings : Surroundings
            The muscle.

        Returns
        -------
        offset, factor : ndarray, shape (rows,)
            o in the response's unit, and f.
        """
        if type(self).advance is MaterialEffect.advance:
            return np.zeros(len(drive)), np.ones(len(drive))
        self.start()
        columns = [np.broadcast_to(column, np.shape(drive)).tolist()
                   for column in (drive, drive_squared, *inputs)]
        added = [self.advance(value, felt, Inputs(*row), surroundings)
                 for value, felt, *row in zip(*columns)]
        offset, factor = np.array(added, dtype=float).reshape(-1, 2).T
        return offset, factor

    def advance(self, drive: float, drive_squared: float, inputs: Inputs,
                surroundings: Surroundings) -> tuple[float, float]:
        """Return `drift` of the next row; an effect with a past defines this and `start`."""
        if type(self).drift is MaterialEffect.drift:
            return 0.0, 1.0
        offset, factor = self.drift(np.array([drive]), np.array([drive_squared]),
                                    Inputs(*(np.array([value]) for value in inputs)), surroundings)
        return float(offset[0]), float(factor[0])


@dataclasses.dataclass
class Statics:
    """
    The arm at rest on a grid of angles: what the linkage asks of each muscle.

    All arrays have shape (n,): `theta` [rad], elongation `length` [m], `moment_arm` [m], the
    total `moment` [N m] that the muscles have to hold, and `upright` [rad], the angle between the
    forearm and what really is upwards, along which weights pull.
    """

    theta: np.ndarray
    length: np.ndarray
    moment_arm: np.ndarray
    moment: np.ndarray
    upright: np.ndarray

    @classmethod
    def of(cls, geometry: BicepGeometry, theta: np.ndarray) -> 'Statics':
        """Return the arm that the geometry describes, without any effect."""
        return cls(theta, geometry.length(theta), geometry.moment_arm(theta),
                   geometry.load_moment(theta), theta)


class MechanismEffect(Effect):
    """Effect on the arm: what it asks of the muscle at rest, and what resists its motion."""

    stage = 'mechanism'
    # When one of the muscles breaks, since the recording began [s].
    break_time: float = math.inf

    def forward(self, statics: Statics, geometry: BicepGeometry) -> Statics:
        """Return the arm at rest with the effect; by default unchanged."""
        return statics

    def resistance(self) -> tuple[float, float, float]:
        """
        Return what resists motion.

        Returns
        -------
        tuple of float
            Coulomb moment [N m], viscous coefficient [N m s/rad], moment of inertia [kg m^2].
        """
        return 0.0, 0.0, 0.0

    def stiction(self) -> float:
        """Return the share by which the Coulomb moment of an arm at rest exceeds that in motion."""
        return 0.0

    def capstan(self) -> float:
        """Return mu phi, by whose exponential the muscles' cables change a tension in motion."""
        return 0.0

    @property
    def moves(self) -> bool:
        """Whether the arm's own velocity or acceleration counts."""
        return any(self.resistance()[1:])


class SensorEffect(Effect):
    """
    Effect between the true response and the measured one.

    One without a past defines `forward` or `step`, one with a past `step` and `start`.
    """

    stage = 'sensor'
    kinds: ClassVar[tuple[str, ...]] = ('arm', 'bench')
    # Whether a row's measured response depends on its true one and on earlier turns alone.
    rowwise: ClassVar[bool] = False
    # A turn of the wanted response up to this does not turn what the inverse adds by direction.
    dead_band: float = 0.0

    def begin(self, rest: float) -> None:
        """Take up the response of the state of rest before a trial, after `start`."""

    def start_from(self, rest: float) -> float:
        """Start from the state of rest with its response, and return what it is measured as."""
        self.start()
        self.begin(rest)
        measured = self.step(rest, 0.0)
        self.start()
        self.begin(rest)
        return measured

    def forward(self, response: Values, inputs: Inputs) -> Values:
        """Map the response of one trial, shape (rows,)."""
        if type(self).step is SensorEffect.step:
            return response
        self.start()
        times = np.broadcast_to(inputs.dt, np.shape(response)).tolist()
        return np.array([self.step(value, dt) for value, dt in zip(response.tolist(), times)])

    def step(self, value: float, dt: float) -> float:
        """Advance by one sample taken `dt` seconds after the one before."""
        if type(self).forward is SensorEffect.forward:
            return value
        inputs = Inputs(*(np.array([entry]) for entry in (0., 0., dt, math.nan, math.nan, 0.)))
        return float(self.forward(np.array([value]), inputs)[0])

    def rows_read(self, asked: np.ndarray, inputs: Inputs) -> np.ndarray:
        """
        Return the rows whose true response is read for the measured one of some rows.

        Where an input turns, starts or stops, the response is known in any case.

        Parameters
        ----------
        asked : ndarray of bool, shape (rows,)
            Rows of one trial whose measured response is wanted.
        inputs : Inputs

        Returns
        -------
        ndarray of bool, shape (rows,)
            All, if the effect is not `rowwise`.
        """
        return asked if self.rowwise else np.ones_like(asked)

    def inverse(self, response: float) -> float:
        """Return the true response that is measured as `response`."""
        return response
