# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The second stage as a controller needs it: one muscle, or parallel ones of unequal length."""

from collections.abc import Mapping, Sequence
import copy
from typing import Any

import numpy as np

from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.kernels.load_play import held
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.operators import HysteresisOperator

# Elongation [m] by which elastic wires may leave the range of the transformation.
ELASTIC_ROOM = 0.02


class SecondStage:
    """
    H2 with its memory: ``output = H2[sign (x - load)]``, and the inverse for x (Eq. 13).

    Where the load widens the loop, the input of H2 is that of `kernels.load_play`.

    Parameters
    ----------
    operator : HysteresisOperator
        The second stage H2; it is copied.
    sign : int
        -1 for muscles that contract when driven, 1 for one that extends.
    chain : Chain
        Effects of the model: excess lengths of the muscles, and how a wire strains under its load.
    loaded : bool
        Whether the load is weighed against x; loads do not count else.
    """

    def __init__(self, operator: HysteresisOperator, sign: int, chain: Chain, loaded: bool) -> None:
        self._chain, self._loaded = chain, loaded
        self._bundle = Bundle(operator, chain, loaded) if len(chain.offsets) > 1 else None
        self._operators = self._bundle.operators if self._bundle else [copy.deepcopy(operator)]
        self._sign = sign
        self.base, self._top = operator.output_range
        self._room = max(abs(excess) for excess in chain.offsets) + ELASTIC_ROOM

    def reset(self) -> None:
        """Wipe the memory."""
        for operator in self._operators:
            operator.reset()

    def save(self) -> list[dict[str, Any]]:
        """Return the memory as plain types."""
        return [operator.save() for operator in self._operators]

    def restore(self, state: Sequence[Mapping[str, Any]]) -> None:
        """
        Take back what `save` returned.

        Raises
        ------
        ParameterError, ValueError
            If it was saved by other muscles.
        """
        for operator, entry in zip(self._operators, state, strict=True):
            operator.restore(entry)

    def settle_cold(self, x: float, load: float, inputs: Sequence[float] | None = None) -> None:
        """
        Start from the cold state.

        Parameters
        ----------
        x, load : float
            Output of the first stage, and load that is borne, both cold.
        inputs : sequence of float, optional
            What each muscle starts from, where that is known better.
        """
        self.reset()
        self.step(self.respond(x, load)[1] if inputs is None else inputs)

    @property
    def output(self) -> float:
        """What the transformation gives [m]; the mean of the muscles."""
        outputs = [operator.output for operator in self._operators]
        return sum(outputs) / len(outputs)

    def drive(self, output: float, load: float, dead_band: float = 0.0) -> tuple[float, bool]:
        """Return x for an output [m] under a load, and whether that output is out of reach."""
        inside, width = self._felt(load)
        if self._bundle is not None:
            return self._bundle.drive(output, inside), False
        operator = self._operators[0]
        found = operator.invert(output, dead_band=dead_band)
        play = width if found.input > operator.input else 0.0
        return self._sign * found.input + inside - play, found.saturated

    def respond(self, x: float, load: float) -> tuple[float, list[float]]:
        """Return the output [m] and the inputs that `step` would commit."""
        inside, width = self._felt(load)
        if self._bundle is not None:
            return self._bundle.respond(
                x, inside, self.base - self._room, self._top + self._room, self.base)
        u = self._sign * (x - inside)
        if width > 0.0:
            u = held(self._operators[0].input, u, width)
        return self._operators[0].peek(u), [u]

    def _felt(self, load: float) -> tuple[float, float]:
        """Return a load as the transformation feels it, and by how much it widens the loop."""
        if not self._loaded:
            return 0.0, 0.0
        felt = np.float64(load)
        return float(self._chain.load_inside(felt)), float(self._chain.loop_width(felt))

    def step(self, inputs: Sequence[float]) -> None:
        """Commit each muscle's input."""
        for operator, u in zip(self._operators, inputs):
            operator.step(u)
