# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The ends of a heated wire stay cold, because its clamps take their heat."""

import functools
import math

import numpy as np

from hysteresis_ros.effects.base import Parameter, Surroundings
from hysteresis_ros.effects.electrical import ELECTRIC_DRIVES
from hysteresis_ros.effects.stages import MaterialEffect

# Distance from a clamp, in units of lambda, beyond which the wire is taken to be alike: it lacks
# exp(-6), 0.2 % of its excess there.
ALIKE = 6.0
# Places between the clamp and there: twice as many change less than 1e-4 of a stroke.
PLACES = 24
# It takes a ms to compute, and a diagnosis asks for it thousands of times.
_gauss_legendre = functools.cache(lambda: np.polynomial.legendre.leggauss(PLACES))


class ColdClamps(MaterialEffect):
    """
    Heat flows along the wire into its clamps, so that its ends transform later, or not at all.

    A wire loses heat to the air, and at its ends to the clamps, which stay as cold as the air: it
    is a fin of length l between two cold walls. What matters is ``lambda = sqrt(k d / (4 h))``,
    over which the ends warm up: about 3 mm for a NiTi wire of 0.2 mm in still air (k = 18 W/(m K),
    h = 100 W/(m^2 K)), less in a fan, more for thicker wires. Each place transforms by its own
    temperature, and the elongations add up. On a bench whose wires have the same length the
    weights of H2 contain it; it shows where the arm's wires are shorter, or held in heavier clamps.
    """

    id = 'cold_clamps'
    sentence = 'The clamps keep the ends of the heated wire cold, so that they transform later.'
    equation = ('L = mean over z from 0 to l / 2 of H2[F - x(g(z) V^2)], x the first stage, '
                'g = 1 - cosh(z / lambda) / cosh(l / (2 lambda)), z the distance from the middle, '
                'share = 2 lambda / l')
    source = ('temperature along a fin (Incropera and DeWitt, Fundamentals of Heat and Mass '
              'Transfer, Wiley, ch. 3)')
    shows_in = 'stroke that is missing at full heat, and a loop with a tail to more drive'
    experiment = ('compare the stroke of a short wire with that of a long one, or look at the ends '
                  'of the hot wire with a thermal camera')
    confused_with = ('unequal_muscles', 'airflow', 'supply_sag')
    parameters = (
        Parameter('share', '1', 'part 2 lambda / l of the wire that its ends take', 0.005, 0.3,
                  0.0, (0.03, 0.12), log=True, limits=(0.001, 1.0)),)

    @property
    def places(self) -> tuple[np.ndarray, np.ndarray] | None:   # type: ignore[override]
        """Return parts of the wire, and the excess g of each over that of a long wire, (K,)."""
        if self.share <= 0.0:
            return None
        half = 1.0 / self.share
        depth = min(half, ALIKE)
        points, weights = _gauss_legendre()
        parts = 0.5 * weights * depth / half
        # Exponentials of negative numbers only: cosh(l / (2 lambda)) would overflow.
        whole = 1.0 + math.exp(-2.0 * half)
        from_clamp = 0.5 * depth * (1.0 + points)
        lacking = (np.exp(-from_clamp) + np.exp(from_clamp - 2.0 * half)) / whole
        if half > depth:
            rest = (math.exp(-depth) - math.exp(depth - 2.0 * half)) / whole / (half - depth)
            parts = np.append(parts, 1.0 - depth / half)
            lacking = np.append(lacking, rest)
        return parts, 1.0 - lacking

    @classmethod
    def available(cls, surroundings: Surroundings) -> bool:
        """Whether the drive heats a wire that then contracts, whose H2 is a Preisach operator."""
        heated = surroundings.drive in (*ELECTRIC_DRIVES, 'power')
        return heated and surroundings.sign < 0 and surroundings.operator == 'preisach'
