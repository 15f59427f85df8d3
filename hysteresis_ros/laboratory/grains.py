# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A wire's grains: each turns from martensite into austenite when heated, and back when cooled.

A grain turns to austenite around its own temperature A and back to martensite around M < A. Stress
favours martensite and moves both up by sigma / C (Clausius-Clapeyron), so what a grain feels is the
temperature less that shift, which is not quite the same on heating and on cooling. A grain does
not turn all at once but over `SMEAR` kelvin: the population then answers continuously and its
equilibrium with a spring or an arm can be solved for.
"""

import dataclasses
import math
from typing import TypeAlias

import numpy as np

# Width over which one grain turns [K]; far below the population's spread, far above its spacing.
SMEAR = 2.5
# Share of the grains that make up the foot of the distribution.
FOOT_SHARE = 0.05
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)

# A temperature of all grains, or one of each, shape (count,).
Felt: TypeAlias = float | np.ndarray


@dataclasses.dataclass(frozen=True)
class GrainDistribution:
    """
    Where the grains turn, at zero stress.

    The heating temperatures rise steeply from a short foot and end in a long hot tail; the widths
    of the grains' own loops grow along them.

    Parameters
    ----------
    start : float
        Heating temperature at which the bulk of the grains begins to turn to austenite [degC].
    foot : float
        How far below that the very first grains turn [K].
    spread : float
        Distance from the start to the median grain [K], the hot tail aside.
    shape : float
        Asymmetry: exponent of the quantile function; 1 is uniform, larger is denser at the start.
    tail : float
        Length of the exponential hot tail over the spread.
    loop : float
        Hysteresis of the first grains, heating less cooling temperature [K].
    loop_growth : float
        Further hysteresis of the last grains [K].
    loop_spread : float
        Spread of the hysteresis among grains of the same heating temperature [K].
    """

    start: float = 31.0
    foot: float = 4.5
    spread: float = 8.0
    shape: float = 1.6
    tail: float = 0.42
    loop: float = 4.6
    loop_growth: float = 7.0
    loop_spread: float = 2.0

    def temperatures(self, count: int, offset: float) -> tuple[np.ndarray, np.ndarray]:
        """
        Return heating and cooling temperatures of `count` grains [degC], each shape (count,).

        Quantiles instead of random draws keep the population smooth; `offset` in [0, 1) is what
        differs from one specimen to the next.
        """
        rank = (np.arange(count) + 0.5) / count
        heating = self.start + self.spread * (
            (2.0 * rank) ** self.shape - self.tail * np.log1p(-rank))
        heating -= self.foot * np.exp(-rank / FOOT_SHARE)
        # A low-discrepancy sequence spreads the loops evenly at every heating temperature.
        other = (offset + GOLDEN * np.arange(count)) % 1.0
        loop = (self.loop + self.loop_growth * rank
                + self.loop_spread * (other - 0.5) * (1.0 + rank))
        return heating, heating - np.maximum(loop, 1.0)


class Grains:
    """
    State of the grains of one wire, all martensite at first.

    Parameters
    ----------
    heating, cooling : ndarray, shape (count,)
        Temperatures at which the grains turn to austenite and back [degC], from the distribution.
    """

    def __init__(self, heating: np.ndarray, cooling: np.ndarray) -> None:
        self._upper = heating / SMEAR + 0.5
        self._lower = cooling / SMEAR + 0.5
        self._share = np.ones(len(heating))
        self._next = np.ones(len(heating))
        self._work = np.ones(len(heating))

    def _turn(self, heating: Felt, cooling: Felt) -> np.ndarray:
        # Martensite may not exceed what heating leaves, nor fall below what cooling has formed.
        result = np.subtract(self._lower, cooling / SMEAR, out=self._next)
        np.maximum(result, self._share, out=result)
        np.minimum(result, np.subtract(self._upper, heating / SMEAR, out=self._work), out=result)
        np.maximum(result, 0.0, out=result)
        return np.minimum(result, 1.0, out=result)

    def peek(self, heating: Felt, cooling: Felt) -> float:
        """
        Return the martensite share that the grains would have; their state stays.

        Parameters
        ----------
        heating, cooling : float or ndarray, shape (count,)
            Temperature felt by the turn to austenite and by the turn back [degC].
        """
        return float(self._turn(heating, cooling).sum()) / len(self._share)

    def commit(self, heating: Felt, cooling: Felt) -> float:
        """Bring the grains to the felt temperatures [degC] and return the martensite share."""
        share = float(self._turn(heating, cooling).sum()) / len(self._share)
        self._share, self._next = self._next, self._share
        return share

    @property
    def martensite(self) -> np.ndarray:
        """Martensite share of each grain, shape (count,)."""
        return self._share.copy()

    def turned(self, heating: Felt, cooling: Felt) -> np.ndarray:
        """Return the share that each grain would have, shape (count,); their state stays."""
        return self._turn(heating, cooling).copy()
