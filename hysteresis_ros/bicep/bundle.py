# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Parallel muscles of unequal length as a controller needs them; see `kernels.bundle`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.bicep.wires import kernels_for, wires_of
from hysteresis_ros.kernels import bundle
from hysteresis_ros.kernels.formation import SIZE
from hysteresis_ros.operators import HysteresisOperator

if TYPE_CHECKING:
    from hysteresis_ros.model.chain import Chain


class Bundle:
    """
    Parallel muscles, each with a memory of its own, that end on one clamp.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2 of one muscle; it is copied for each.
    chain : Chain
        Effects of the model: excess lengths of the muscles, and how a wire strains under its load.
    loaded : bool
        Whether the load is weighed against the drive.

    Attributes
    ----------
    muscles : ndarray, shape (muscles, 5)
        What is remembered of each in addition to its operator's memory; see `kernels.formation`.
    """

    def __init__(self, operator: HysteresisOperator, chain: Chain, loaded: bool) -> None:
        self._wires, self.operators, self._memories = wires_of(operator, chain, loaded)
        self._kernels = kernels_for(operator, bundle)
        self._search = np.zeros(bundle.SEARCH)
        self._search[bundle.GAIN] = 1.0
        self.muscles, self._following = np.zeros((2, len(self.operators), SIZE))

    def drive(self, output: float, load: float) -> float:
        """Return the x [N] under which the muscles give `output` [m] and bear `load` [N] each."""
        return self._kernels.drive(self._wires, self._memories, self._search, float(output),
                                   float(load), self.muscles)

    def respond(self, x: float, load: float, low: float, high: float,
                near: float) -> tuple[float, np.ndarray]:
        """
        Return what the muscles give, and `muscles` with inputs of H2 that do; commits nothing.

        Parameters
        ----------
        x : float
            Output of the first stage.
        load : float
            Load that each bears on average [N].
        low, high, near : float
            Limits of the output [m], and where to look first.
        """
        output = self._kernels.respond(
            self._wires, self._memories, self._search, float(x), float(load), float(low),
            float(high), float(near), self.muscles, self._following)
        return output, self._following.copy()
