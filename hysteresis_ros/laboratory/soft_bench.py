# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The bench of Fig. 6 with a muscle that is no wire, held at its resting length or under a weight.

A trial begins with one hold at the highest drive and one without. Its steps are held as long: the
muscle goes on creeping, as on a real bench.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.laboratory import sensors
from hysteresis_ros.laboratory.soft_muscle import SoftMaterial
from hysteresis_ros.laboratory.tendon import Tendon

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# A hold is computed in these parts, short ones first: most happens at its beginning.
PARTS = (0.01, 0.03, 0.08, 0.18, 0.3, 0.4)
# In a continuous recording no part is longer than about this [s].
LONGEST_PART = 0.1
# Noise of the load cell over its range.
FORCE_NOISE = 1e-3


class SoftBench:
    """
    One muscle on the bench.

    Parameters
    ----------
    material : SoftMaterial
        Of this specimen.
    seed : int or sequence of int
        Of the sensors' noise.
    tendon : Tendon
        On which weights hang.
    """

    def __init__(self, material: SoftMaterial, seed: int | Sequence[int] = 0,
                 tendon: Tendon = Tendon()) -> None:
        self.material, self._tendon, self._hung = material, tendon, 0.0
        self._muscle = material.muscle()
        self._rng = np.random.default_rng(seed)
        self._begin(material.pretension)
        self._resting = self._muscle.elongation

    def force_trial(self, drives: ArrayLike) -> np.ndarray:
        """
        Measure the force of the muscle clamped at its resting length (Fig. 3a).

        Parameters
        ----------
        drives : array_like, shape (n,)
            Each held for the material's `hold` [V or Pa].

        Returns
        -------
        ndarray, shape (n,)
            Readings of the load cell at the end of each step [N].
        """
        material, muscle = self.material, self._muscle
        self._begin(material.pretension)
        place = muscle.elongation

        def step(drive: float, dt: float) -> None:
            muscle.clamp(drive, dt, place, material.pretension, material.frame_stiffness)
        readings = []
        for drive in np.asarray(drives, dtype=float).tolist():
            self._hold(step, drive)
            force = material.pretension - material.frame_stiffness * (muscle.elongation - place)
            readings.append(sensors.load_cell(
                force, self._rng, FORCE_NOISE * material.largest_force))
        return np.array(readings)

    def length_trial(self, drives: ArrayLike, load: float) -> np.ndarray:
        """
        Measure the elongation of the muscle under a dead weight (Fig. 3b).

        Parameters
        ----------
        drives : array_like, shape (n,)
            Each held for the material's `hold` [V or Pa].
        load : float
            Weight of what hangs on the muscle [N].

        Returns
        -------
        ndarray, shape (n,)
            Readings of the position sensor at the end of each step [m].
        """
        muscle = self._muscle
        self._begin(load)
        readings = []
        for drive in np.asarray(drives, dtype=float).tolist():
            self._hold(lambda drive, dt: muscle.hang(drive, dt, load), drive)
            readings.append(self._read_length(load))
        return np.array(readings)

    def length_run(self, dt: float, drives: ArrayLike, load: float) -> np.ndarray:
        """
        Record the elongation under a dead weight continuously.

        Parameters
        ----------
        dt : float
            Time between samples [s].
        drives : array_like, shape (n,)
            What was applied up to each sample, since the one before [V or Pa].
        load : float
            Weight of what hangs on the muscle [N].

        Returns
        -------
        ndarray, shape (n,)
            Readings of the position sensor [m].
        """
        muscle, parts = self._muscle, max(1, round(dt / LONGEST_PART))
        self._begin(load)
        readings = []
        for drive in np.asarray(drives, dtype=float).tolist():
            for _ in range(parts):
                muscle.hang(drive, dt / parts, load)
            self._hung += dt
            readings.append(self._read_length(load))
        return np.array(readings)

    def _begin(self, load: float) -> None:
        """Take a rested muscle and drive it once fully up and down under a weight."""
        muscle = self._muscle
        muscle.reset()
        self._hung = 0.0
        for drive in (0.0, self.material.highest_drive, 0.0):
            self._hold(lambda drive, dt: muscle.hang(drive, dt, load), drive)

    def _hold(self, step: Callable[[float, float], None], drive: float) -> None:
        for part in PARTS:
            step(drive, part * self.material.hold)
        self._hung += self.material.hold

    def _read_length(self, load: float) -> float:
        elongation = self._muscle.elongation + self._tendon.elongation(load, self._hung)
        return sensors.position_sensor(elongation - self._resting, self._rng)
