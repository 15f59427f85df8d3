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
from ..errors import ParameterError


class Cascade:
    """
    Operators embedded in one another (Eqs. 7 and 25).

    Parameters
    ----------
    stages : sequence of HysteresisOperator
        T_1, ..., T_S, at least one. Their memory is that of the cascade.

    Raises
    ------
    ParameterError
        If there is no stage.

    """

    def __init__(self, stages: Sequence[HysteresisOperator]) -> None:
        self.stages = tuple(stages)
        if not self.stages:
            raise ParameterError('cascade: no stages given, at least one is needed')

    @property
    def output(self) -> float:
        """Output of the last stage for the inputs committed last."""
        return self.stages[-1].output

    def reset(self) -> None:
        """Bring every stage into its cold state."""
        for stage in self.stages:
            stage.reset()

    def step(self, inputs: Sequence[float]) -> float:
        """Commit inputs, x_1 to x_S, and return the output (Eq. 25)."""
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
        columns = np.asarray(inputs, dtype=float).T
        y = np.zeros(columns.shape[1:])
        for stage, x in zip(self.stages, columns, strict=True):
            y = stage.simulate(x - y)
        return y

    def invert(self, y: float, coupled: Sequence[float] = (),
               *options: Sequence[float]) -> Inversion:
        """
        Find the drive for an output and coupled inputs (Eqs. 13 and 14); commit nothing.

        Parameters
        ----------
        y : float
            Requested output.
        coupled : sequence of float, length S - 1
            The inputs of the stages after the first.
        options : sequences of float, length S or empty
            Options of each stage's inverse, see `HysteresisOperator.invert`.

        Returns
        -------
        Inversion
            The drive, the output that it gives, and whether that is not what was asked for because
            a stage cannot give as much. If a number is not finite the present drive, flagged as
            saturated.

        """
        if not all(map(math.isfinite, (y, *coupled))):
            return Inversion(self.stages[0].input, self.output, True)
        wanted, beyond = y, False
        for k in range(len(self.stages) - 1, -1, -1):
            drive, _, saturated = self.stages[k].solve(
                wanted, *(option[k] for option in options if option))
            beyond = beyond or saturated
            wanted = coupled[k - 1] - drive if k else 0.0
        reached = self.peek((drive, *coupled))
        # On a plateau of a later stage what an earlier one lacks does not show.
        exact = abs(reached - y) <= resolution(self.stages[-1].output_range)
        return Inversion(drive, reached, beyond and not exact)

    def invert_length(self, length: float, force: float, *options: Sequence[float]) -> Inversion:
        """Find the drive for a length under a force, with two stages."""
        return self.invert(length, (force,), *options)
