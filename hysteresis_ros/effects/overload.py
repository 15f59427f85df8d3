# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A muscle that was loaded beyond its yield stress, or overheated, is another one for good."""

import math

import numpy as np

from hysteresis_ros.effects.base import Inputs, Parameter, Surroundings
from hysteresis_ros.effects.change_point import change_of_line, change_points, NEVER
from hysteresis_ros.effects.stages import MaterialEffect


class Overload(MaterialEffect):
    """
    Beyond a load the muscle yields, and keeps a residual strain of the largest load it has borne.

    One way: neither less load nor heating and cooling undo it, and a trial begins with what those
    before have left. What a recording does not make larger any more looks like `slack`. On a bench
    with constant loads it is a part of the elongation under each. No controller undoes it: the
    muscle has to be adjusted.

    What was overheated, or overloaded while it was hot, has also lost a share of its stroke. That
    need not have been the largest drive or load so far: it happened at a moment, which counts in
    each recording from its own start. What is only longer from a moment on may have slipped.
    """

    id = 'overload'
    sentence = ('Loads beyond the yield stress have lengthened the muscle for good, or too much '
                'heat has cost it stroke.')
    equation = ('L += max(0, F - Fy) / K, F the largest load so far; or, from t on, L += e l0 and '
                'stroke times (1 - lost)')
    source = ('plasticity with linear hardening: residual strain (sigma - sigma_y) / H; stroke '
              'lost by overheating: Lagoudas (ed.), Shape Memory Alloys, Springer 2008, ch. 1')
    shows_in = ('the first time that the load rises beyond all before, or everything from one '
                'moment on')
    experiment = 'raise the load step by step, and go back to a small one after each'
    confused_with = ('slack', 'series_compliance', 'fatigue')
    invertible = False

    # A loss of stroke to begin a fit at.
    TYPICAL = 0.1

    parameters = (
        Parameter('Fy', 'loads', "load from which it yields over the bench's mean load", 0.2, 5.0,
                  1.0, (0.7, 1.1, 1.4), log=True, with_form='compliance'),
        # Of 0.2 mm and 0.27 m with a hardening modulus of 0.4 to 80 GPa.
        Parameter('compliance', 'mm/N', 'residual elongation per load beyond, 1 / K', 0.1, 20.0,
                  0.0, (1.5, 6.0), log=True, scale='compliance', form=True),
        # Less than a model of the arm is off by is none; and what has lost all drives nothing.
        Parameter('lost', '1', 'share of the stroke that is lost from t on', 0.03, 0.9, 0.0, (0.0,),
                  kinds=('arm',), limits=(0.0, 1.0), form=True),
        Parameter('e', '% of l0', 'residual strain from t on, negative where the cold muscle stays '
                  'shorter', 0.0, 6.0, 0.0, (0.0,), both_signs=True, kinds=('arm',),
                  with_form='lost'),
        Parameter('t', 's', 'when that was, since the recording began', 1.0, 1e5, NEVER, (NEVER,),
                  log=True, kinds=('arm',), with_form='lost'),)

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether a load was there at all."""
        return surroundings.load > 0.0

    def yields(self, surroundings: Surroundings) -> tuple[float, float]:
        """Return Fy [N] and 1 / K [m/N]."""
        if self.compliance <= 0.0:
            return math.inf, 0.0
        return self.Fy * surroundings.load, 1e-3 * self.compliance

    @property
    def size_parameter(self) -> Parameter:
        """Return the share lost where stroke is, else the load from which it yields."""
        return next(parameter for parameter in self.parameters
                    if parameter.name == ('lost' if self.lost else 'Fy'))

    def moments(self, residual: np.ndarray, response: np.ndarray, clock: np.ndarray
                ) -> list[dict[str, float]]:
        """Return losses of stroke at moments from which the residual goes another way."""
        times = [change_of_line(residual, response, clock), *change_points(residual, clock)]
        return [{'compliance': 0.0, 'lost': self.TYPICAL, 't': time}
                for time in dict.fromkeys(times) if time is not None]

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the residual strain, and the stroke that is left, of a whole trial."""
        from_then_on = np.asarray(inputs.clock) >= (self.t if self.lost else math.inf)
        after = np.where(from_then_on, 1.0, 0.0) + 0.0 * drive
        return self.e / 100.0 * surroundings.length * after, 1.0 - self.lost * after
