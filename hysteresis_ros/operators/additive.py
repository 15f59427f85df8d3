# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The additive model that the paper rejects, L = H3[F] - H4[V] (Sec. III-B)."""

from typing import Sequence

import numpy as np

from .base import HysteresisOperator
from .coupled import Coupled
from ..errors import ParameterError


class Additive(Coupled):
    """
    Output = load operator of the load minus drive operator of the drive.

    Both terms keep their shape whatever the other input does; only the offset between them
    changes. Rows of the least squares for both at once are ``[signed_areas(n3, F),
    -signed_areas(n4, V)]``.

    Parameters
    ----------
    stages : sequence of two HysteresisOperator
        H4, of the drive V, and H3, of the load F, in the order of the inputs (V, F).

    Raises
    ------
    ParameterError
        If there are not two operators of their own.

    """

    kind = 'additive'

    def __init__(self, stages: Sequence[HysteresisOperator]) -> None:
        super().__init__(stages)
        if len(self.stages) != 2:
            raise ParameterError(f'additive model: {len(self.stages)} stages given, 2 needed: '
                                 'that of the drive and that of the load')

    @property
    def output(self) -> float:
        """Output for the inputs committed last."""
        drive, load = self.stages
        return load.output - drive.output

    def step(self, inputs: Sequence[float]) -> float:
        """Commit (drive, load) and return the output."""
        (drive, load), (v, f) = self.stages, inputs
        return load.step(f) - drive.step(v)

    def peek(self, inputs: Sequence[float]) -> float:
        """Return the output that `step` would give, and commit nothing."""
        (drive, load), (v, f) = self.stages, inputs
        return load.peek(f) - drive.peek(v)

    def simulate(self, inputs: np.ndarray) -> np.ndarray:
        """Commit a sequence of inputs, shape (M, 2), and return the outputs, shape (M,)."""
        drive, load = self.stages
        v, f = self.columns(inputs).T
        return load.simulate(f) - drive.simulate(v)

    def _solve(self, y: float, coupled: Sequence[float],
               dead_bands: Sequence[float]) -> tuple[float, float, bool]:
        drive, load = self.stages
        level = load.peek(coupled[0])
        v, reached, saturated = drive.solve(level - y, dead_bands[0])
        return v, level - reached, saturated
