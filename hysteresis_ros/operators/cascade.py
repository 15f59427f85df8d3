# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Operators embedded in one another: the paper's two stages, and N of them (Eq. 25).

    y = T_S[x_S - T_(S-1)[x_(S-1) - ... T_2[x_2 - T_1[x_1]] ...]]

With two stages this is Eq. 7, L = H2[F - H1[V]]: drive x_1 = V, coupled input x_2 = F.
"""

import math
from typing import Sequence

import numpy as np

from .base import HysteresisOperator, Inversion, resolution
from .coupled import Coupled
from .linear import Linear
from ..errors import ParameterError

# A stage that misses its target by more than this many times the rounding is not exact.
_EXACT = 10.0


class Cascade(Coupled):
    """
    Operators embedded in one another (Eqs. 7 and 25).

    Parameters
    ----------
    stages : sequence of HysteresisOperator
        T_1, ..., T_S, at least one. The model owns them.

    Raises
    ------
    ParameterError
        If there is no stage, or one is no operator of its own.

    """

    kind = 'cascade'

    def __init__(self, stages: Sequence[HysteresisOperator]) -> None:
        super().__init__(stages)
        if not self.stages:
            raise ParameterError('cascade model: no stages given, at least one is needed')
        self._slack = [_EXACT * resolution(stage.output_range) for stage in self.stages]

    @property
    def output(self) -> float:
        """Output of the last stage for the inputs committed last."""
        return self.stages[-1].output

    def step(self, inputs: Sequence[float]) -> float:
        """
        Commit inputs and return the output (Eq. 25).

        Parameters
        ----------
        inputs : sequence of float, length S
            x_1, ..., x_S; for the muscle (V, F).

        """
        y = 0.0
        for stage, x in zip(self.stages, inputs, strict=True):
            y = stage.step(x - y)
        return y

    def peek(self, inputs: Sequence[float]) -> float:
        """Return the output that `step` would give, and commit nothing."""
        y = 0.0
        for stage, x in zip(self.stages, inputs, strict=True):
            y = stage.peek(x - y)
        return y

    def simulate(self, inputs: np.ndarray) -> np.ndarray:
        """Commit a sequence of inputs, shape (M, S), and return the outputs, shape (M,)."""
        y = 0.0
        for stage, x in zip(self.stages, self.columns(inputs).T):
            y = stage.simulate(x - y)
        return y

    def _solve(self, y: float, coupled: Sequence[float],
               dead_bands: Sequence[float]) -> tuple[float, float, bool]:
        """Invert the stages from the last to the first (Eqs. 13 and 14)."""
        stages, slack = self.stages, self._slack
        k = len(stages) - 1
        drive, output, saturated = stages[k].solve(y, dead_bands[k])
        exact = True
        while k:
            target = coupled[k - 1] - drive
            k -= 1
            drive, reached, beyond = stages[k].solve(target, dead_bands[k])
            saturated = saturated or beyond
            exact = exact and -slack[k] <= reached - target <= slack[k]
        return drive, output if exact else self.peek((drive, *coupled)), saturated

    def invert_force(self, force: float, dead_band: float = 0.0) -> Inversion:
        """
        Find the drive for a force at resting length: the first stage's inverse (Eq. 12).

        Commit the drive with ``stages[0].step``: the later stages take no part.
        """
        return self.stages[0].invert(force, dead_band)

    def invert_length(self, length: float, force: float,
                      dead_bands: Sequence[float] = ()) -> Inversion:
        """
        Find the drive for a length under a force, with two stages (Eqs. 13 and 14).

        Parameters
        ----------
        length, force : float
            References L_d and F_d.
        dead_bands : sequence of float, length 2 or empty
            Of H1's and H2's inverse, see `HysteresisOperator.invert`.

        """
        return self.invert(length, (force,), dead_bands)


def linear_model(force_slope: float, force_intercept: float, length_slope: float,
                 lower: float, upper: float, forces: tuple[float, float]) -> Cascade:
    """
    Build the paper's linear model L = k2 (F - k1 V - F0) of Eq. 11; its inverse is Eq. 15.

    Parameters
    ----------
    force_slope, force_intercept, length_slope : float
        k1 [N/V], F0 [N] and k2 [m/N].
    lower, upper : float
        Range of the drive [V].
    forces : tuple of float
        Smallest and largest force F [N].

    """
    first = Linear(force_slope, force_intercept, lower, upper)
    return Cascade([first, Linear(length_slope, 0.0, *_difference(forces, first))])


def linear_drive_model(slope: float, intercept: float, lower: float, upper: float,
                       operator: HysteresisOperator) -> Cascade:
    """
    Build L = H5[F - a1 V - a0] of Sec. III-B: the drive's own hysteresis is left out.

    Parameters
    ----------
    slope, intercept : float
        a1 and a0.
    lower, upper : float
        Range of the drive.
    operator : HysteresisOperator
        H5, over F - a1 V - a0.

    """
    return Cascade([Linear(slope, intercept, lower, upper), operator])


def _difference(values: tuple[float, float], stage: HysteresisOperator) -> tuple[float, float]:
    """Return the range of a coupled input minus a stage's output."""
    low, high = stage.output_range
    ends = min(values) - high, max(values) - low
    if not all(map(math.isfinite, ends)):
        raise ParameterError(f'linear model: force range {values} is not finite')
    return ends
