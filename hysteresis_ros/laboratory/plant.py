# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
One specimen of everything: its wire on the bench, and its arm.

About time. Eq. 1 always holds, but how fast the wire follows is a property of the plant,
`heat_time_constant`: 5 s by default, as in the paper, on the bench, for settled steps and for the
simulated board. Continuous recordings of the experiment `arm-dynamic` are made with a thin wire on
which the heat has come and gone before the next sample, `BRISK` = 0.02 s, so that an arm without
any hidden effect is quasi-static at 10 Hz (0.15 s already shows as a lag);
`thermal_lag`, `heating_cooling_asymmetry` and `latent_heat` bring their own seconds along.

About use. An arm's trials belong to one recording: its clock goes on, and what use does to the
wires stays, while every trial starts from the cold state after a full heat and cool cycle. Another
recording is made on an arm of the same build with fresh wires.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import sensors
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.bench import Bench, HOLD
from hysteresis_ros.laboratory.conditions import Conditions
from hysteresis_ros.laboratory.heat import HeatBalance
from hysteresis_ros.laboratory.hidden_physics import apply_effects
from hysteresis_ros.laboratory.hidden_soft import with_effects
from hysteresis_ros.laboratory.muscles import MUSCLES, SOFT_MUSCLES
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.laboratory.wire import Material
from hysteresis_ros.spelling import unknown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# Time constants of Eq. 1 [s]: in the paper, and in continuous recordings.
PAPER, BRISK = 5.0, 0.02


def specimen(seed: int, muscle: str = 'grains') -> Material:
    """
    Return the material of one batch of wire, which differs a little from the next.

    Parameters
    ----------
    seed : int
        Which batch.
    muscle : str
        Constitutive model, a key of `MUSCLES`.

    Raises
    ------
    ParameterError
        For a muscle that does not exist, or is no wire.
    """
    if muscle in SOFT_MUSCLES:
        raise ParameterError(f'laboratory: a {muscle} muscle is on the bench only; the arm is '
                             f'driven by shape memory wires: choose one of {", ".join(MUSCLES)}')
    if muscle not in MUSCLES:
        raise ParameterError(f'laboratory: {unknown("muscle", muscle, MUSCLES)}')
    return MUSCLES[muscle].specimen(np.random.default_rng([seed, 101]))


def bench_of(seed: int, effects: Mapping[str, float] | None = None, recording: int = 0,
             muscle: str = 'grains') -> Plant | SoftBench:
    """
    Return a bench with a muscle of any kind; with a wire, its arm comes along.

    Parameters
    ----------
    seed : int
        Of the specimen and of all noise.
    effects : mapping of str to float
        Strengths of hidden effects, see `Plant` and `hidden_soft`.
    recording : int
        Which recording of the same specimen: another one has other noise.
    muscle : str
        A key of `MUSCLES` or `SOFT_MUSCLES`.

    Raises
    ------
    ParameterError
        For a muscle or an effect that does not exist, or an effect that the muscle cannot have.
    """
    if muscle in SOFT_MUSCLES:
        material = SOFT_MUSCLES[muscle].specimen(np.random.default_rng([seed, 101]))
        changed, tendon = with_effects(material, effects or {}, seed)
        return SoftBench(changed, [seed, recording, 11], tendon)
    if muscle not in MUSCLES:
        every = [*MUSCLES, *SOFT_MUSCLES]
        raise ParameterError(f'laboratory: {unknown("muscle", muscle, every)}')
    return Plant(seed, effects, recording=recording, muscle=muscle)


class Plant:
    """
    A bench and an arm with wires of one batch.

    Parameters
    ----------
    seed : int
        Of the specimen and of all noise.
    effects : mapping of str to float
        Strengths of the effects that are switched on: 1 strong, 0.4 weak. Those of the wire itself
        act on the bench, too; all others on the arm only.
    heat_time_constant : float
        1 / d1 of Eq. 1 on the arm [s]; the bench always has the paper's.
    recording : int
        Which recording of the same specimen: another one has other noise.
    recording_time : float
        About how long a recording on the arm takes [s], for slow and rare effects.
    muscle : str
        Constitutive model of the wires, a key of `MUSCLES`.
    effects_after : float
        Time of the arm [s] at which its effects begin; what belongs to the wire cannot then.

    Raises
    ------
    ParameterError
        For an effect or a muscle that does not exist, an effect that the muscle cannot have,
        or a number that makes no sense.
    """

    def __init__(self, seed: int = 0, effects: Mapping[str, float] | None = None,
                 heat_time_constant: float = PAPER, recording: int = 0,
                 recording_time: float = 900.0, muscle: str = 'grains',
                 effects_after: float = 0.0) -> None:
        if seed < 0 or recording < 0:
            raise ParameterError(f'laboratory: seeds must not be negative, not {seed}, {recording}')
        if not (heat_time_constant > 0.0 and recording_time > 0.0):
            raise ParameterError('laboratory: times must be positive, not '
                                 f'{heat_time_constant!r}, {recording_time!r}')
        self.seed = seed
        self.effects = dict(effects or {})
        self.material = specimen(seed, muscle)
        bench = apply_effects(Conditions(material=self.material), self.effects, seed, bench=True)
        conditions, changed = (
            Conditions(material=self.material, recording_time=recording_time,
                       heat=HeatBalance(time_constant=heat_time_constant)) for _ in range(2))
        apply_effects(changed, self.effects, seed, recording)
        if effects_after > 0.0 and (changed.material is not conditions.material
                                    or changed.wire_offsets != conditions.wire_offsets):
            raise ParameterError(f'laboratory: one of {", ".join(self.effects)} belongs to the '
                                 'wires as they were built; it cannot begin while the arm runs')
        self.bench = Bench(bench, seed=[seed, recording, 11])
        self.arm = Arm(conditions if effects_after > 0.0 else changed, seed=[seed, recording, 12])
        if effects_after > 0.0:
            self.arm.change_at(effects_after, lambda: apply_effects(
                conditions, self.effects, seed, recording))
        self._rng = np.random.default_rng([seed, recording, 13])

    def force_trial(self, voltages: ArrayLike) -> np.ndarray:
        """Return the settled forces [N] of the wire at its resting length, from the cold state."""
        return self.bench.force_trial(voltages)

    def length_trial(self, voltages: ArrayLike, load: float) -> np.ndarray:
        """Return the settled elongations [m] under a load [N], from the cold state."""
        return self.bench.length_trial(voltages, load)

    def arm_trial(self, voltages: ArrayLike, hold: float = HOLD) -> dict[str, np.ndarray]:
        """
        Hold each voltage and measure the arm at the end of it, from the cold state.

        Parameters
        ----------
        voltages : array_like, shape (n,)
            Setpoints [V].
        hold : float
            How long each is held [s].

        Returns
        -------
        dict of str to ndarray, each shape (n,)
            Columns time, voltage, angle, ambient_temperature, supply_voltage.
        """
        voltages = np.asarray(voltages, dtype=float)
        self.arm.heat_and_cool()
        rows = []
        for voltage in voltages.tolist():
            self.arm.settle(hold, self._applied(voltage, hold))
            rows.append(self.read())
        return self._columns(hold * np.arange(1, len(voltages) + 1), voltages, rows)

    def arm_run(self, time: ArrayLike, voltage: ArrayLike) -> dict[str, np.ndarray]:
        """
        Record the arm continuously, from the cold state.

        Parameters
        ----------
        time : array_like, shape (n,)
            Ascending sampling times from the start of the trial [s].
        voltage : array_like, shape (n,)
            Setpoint that was applied up to each time, since the one before [V].

        Returns
        -------
        dict of str to ndarray, each shape (n,)
            Columns time, voltage, angle, ambient_temperature, supply_voltage.
        """
        time, voltage = np.asarray(time, dtype=float), np.asarray(voltage, dtype=float)
        if time.shape != voltage.shape or time.ndim != 1 or np.any(np.diff(time, prepend=0.0) < 0):
            raise ParameterError('laboratory: an arm run needs as many voltages as ascending times')
        self.arm.heat_and_cool()
        rows = []
        for dt, value in zip(np.diff(time, prepend=0.0).tolist(), voltage.tolist()):
            self.arm.advance(dt, self._applied(value, dt))
            rows.append(self.read())
        return self._columns(time, voltage, rows)

    def read(self) -> tuple[float, float, float]:
        """Return the angle [rad], the room's temperature [degC] and the supply voltage [V] now."""
        arm = self.arm
        return (sensors.counted_angle(arm.encoder_counts),
                sensors.thermometer(arm.conditions.air.recorded(arm.time), self._rng),
                sensors.supply_meter(arm.conditions.supply.voltage(arm.time), self._rng))

    def _applied(self, setpoint: float, dt: float) -> float:
        """Return the voltage [V] that a board gives for `dt` [s] which counts on its supply."""
        return setpoint * self.arm.conditions.supply.share(self.arm.time + dt)

    @staticmethod
    def _columns(time: ArrayLike, voltage: ArrayLike,
                 rows: Sequence[tuple[float, float, float]]) -> dict[str, np.ndarray]:
        angle, ambient, supply = np.array(rows).reshape(-1, 3).T
        return {'time': time, 'voltage': voltage, 'angle': angle,
                'ambient_temperature': ambient, 'supply_voltage': supply}
