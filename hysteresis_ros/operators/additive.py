# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The additive model that the paper rejects, L = H3[F] - H4[V] (Sec. III-B)."""

from typing import Sequence

import numpy as np

from .base import HysteresisOperator, Inversion


class Additive:
    """
    Output = load operator of the load minus drive operator of the drive.

    Both terms keep their shape whatever the other input does; only the offset between them
    changes.

    Parameters
    ----------
    drive, load : HysteresisOperator
        H4 and H3. Their memory is that of the model.

    """

    def __init__(self, drive: HysteresisOperator, load: HysteresisOperator) -> None:
        self.stages = drive, load

    def reset(self) -> None:
        """Bring both operators into their cold state."""
        for stage in self.stages:
            stage.reset()

    def step(self, inputs: Sequence[float]) -> float:
        """Commit (drive, load) and return the output."""
        drive, load = self.stages
        return load.step(inputs[1]) - drive.step(inputs[0])

    def simulate(self, inputs: np.ndarray) -> np.ndarray:
        """Commit a sequence of inputs, shape (M, 2), and return the outputs, shape (M,)."""
        drive, load = self.stages
        v, f = np.asarray(inputs, dtype=float).T
        return load.simulate(f) - drive.simulate(v)

    def invert(self, y: float, coupled: Sequence[float]) -> Inversion:
        """Find the drive for an output under a load, (load,); commit nothing."""
        drive, load = self.stages
        level = load.peek(coupled[0])
        v, reached, saturated = drive.solve(level - y)
        return Inversion(v, level - reached, saturated)
