# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Creep of a polymer or rubber under its load, whether it is driven or not."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings, Values
from hysteresis_ros.effects.stages import MaterialEffect
from hysteresis_ros.kernels.creep import relax

# The logarithm as a chain of Kelvin-Voigt elements, each so many times slower than the last.
ELEMENTS, RATIO = 7, 3.0


class ViscoelasticCreep(MaterialEffect):
    """
    Thread, tendon or bladder go on stretching with the logarithm of the time under load.

    Unlike `creep`, which knows only what transforms, it follows the load: every change of it
    creeps by itself, and what is taken off recovers (Boltzmann's superposition). A trial begins
    with a rested muscle. A load that was not recorded, as on an arm, counts as the bench's mean.
    """

    id = 'viscoelastic_creep'
    sentence = 'Under load a polymer goes on stretching, with the logarithm of time.'
    equation = ('L += J l0 (F / Fm) ln(1 + t / t0), Fm the mean load of the bench, as a chain of '
                'Kelvin-Voigt elements de/dt = (F / Fm - e) / tau with tau = 3^k t0, k = 1, 2, ...')
    source = ('linear viscoelasticity: Findley, Lai and Onaran, Creep and Relaxation of Nonlinear '
              'Viscoelastic Materials (1976); Gent, J. Appl. Polym. Sci. 6 (1962) 433, for rubber')
    shows_in = 'time under load, in proportion to the load'
    experiment = 'hang two loads on the undriven muscle and record for half an hour'
    confused_with = ('series_compliance', 'fatigue')
    kinds = ('arm', 'bench')
    invertible = False
    parameters = (
        Parameter('J', '% of l0', "strain per factor e of time under the bench's mean load", 0.01,
                  2.0, 0.0, (0.1, 0.5), log=True),
        Parameter('t0', 's', 'time from which the logarithm counts', 0.1, 300.0, 3.0,
                  (1.0, 10.0, 100.0), log=True),)

    memory = ('_elements',)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether there is a load; of the drives see `doubtful`."""
        return surroundings.load > 0.0

    @classmethod
    def doubtful(cls, surroundings: Surroundings) -> bool:
        """Whether the muscle may be of metal: pressure drives rubber, heat drives both."""
        return surroundings.drive != 'pressure'

    def start(self) -> None:
        """Forget the past: a rested muscle, from which the load was taken."""
        self._elements = [0.0] * ELEMENTS

    def advance(self, drive: float, drive_squared: float, inputs: Inputs,
                surroundings: Surroundings) -> tuple[float, float]:
        """Return the elongation after one more row."""
        total = self._crept(np.array([inputs.load]), np.array([inputs.dt]), surroundings)
        return float(total[0]), 1.0

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the same for a whole trial at once."""
        self.start()
        loads, dt = (np.broadcast_to(column, np.shape(drive)) for column in
                     (inputs.load, inputs.dt))
        return self._crept(loads, dt, surroundings), np.ones(len(drive))

    def _crept(self, loads: Values, dt: Values, surroundings: Surroundings) -> np.ndarray:
        shares = np.where(np.isfinite(loads), loads / (surroundings.load or 1.0), 1.0)
        elements = np.array(self._elements)
        # With these times the sum comes to the logarithm in the long run.
        times = self.t0 * RATIO ** np.arange(1.0, ELEMENTS + 1.0)
        total = relax(shares, np.array(dt, float), times, elements)
        self._elements = elements.tolist()
        return self.J / 100.0 * surroundings.length * math.log(RATIO) * total
