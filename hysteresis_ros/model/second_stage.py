# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The second stage as a controller needs it: one muscle, or parallel ones of unequal length."""

from collections.abc import Mapping, Sequence
import copy
from typing import Any, NamedTuple

from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.kernels.load_play import held
from hysteresis_ros.operators import HysteresisOperator

# Elongation [m] by which elastic wires may leave the range of the transformation.
ELASTIC_ROOM = 0.02


class Load(NamedTuple):
    """
    A load as the transformation feels it.

    `inside` is what the drive is weighed against, and `width` by how much the loop is wider under
    it than that of H2, both in the unit of the load.
    """

    inside: float
    width: float = 0.0


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
    offsets : tuple of float
        Excess length [m] of each parallel muscle; one entry for equal muscles.
    compliance : float
        Elastic compliance of a wire [m/N].
    """

    def __init__(self, operator: HysteresisOperator, sign: int,
                 offsets: tuple[float, ...], compliance: float) -> None:
        self._bundle = Bundle(operator, offsets, compliance) if len(offsets) > 1 else None
        self._operators = self._bundle.operators if self._bundle else [copy.deepcopy(operator)]
        self._sign = sign
        self.base, self._top = operator.output_range
        self._room = max(abs(excess) for excess in offsets) + ELASTIC_ROOM

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

    def settle_cold(self, x: float, load: Load, inputs: Sequence[float] | None = None) -> None:
        """
        Start from the cold state.

        Parameters
        ----------
        x : float
            Output of the first stage, cold.
        load : Load
            That is borne meanwhile.
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

    def drive(self, output: float, load: Load, dead_band: float = 0.0) -> tuple[float, bool]:
        """Return x for an output [m] under a load, and whether that output is out of reach."""
        if self._bundle is not None:
            cooling = output > self.output
            return self._bundle.drive(output, load.inside - cooling * load.width), False
        operator = self._operators[0]
        found = operator.invert(output, dead_band=dead_band)
        play = load.width if found.input > operator.input else 0.0
        return self._sign * found.input + load.inside - play, found.saturated

    def respond(self, x: float, load: Load) -> tuple[float, list[float]]:
        """Return the output [m] and the inputs that `step` would commit."""
        if self._bundle is None:
            u = self._sign * (x - load.inside)
            if load.width > 0.0:
                u = held(self._operators[0].input, u, load.width)
            return self._operators[0].peek(u), [u]
        limits = self.base - self._room, self._top + self._room, self.base
        heated = self._bundle.respond(x, load.inside, *limits)
        if load.width == 0.0 or heated[0] <= self.output:
            return heated
        cooled = self._bundle.respond(x, load.inside - load.width, *limits)
        if cooled[0] >= self.output:
            return cooled
        return self.output, [operator.input for operator in self._operators]

    def step(self, inputs: Sequence[float]) -> None:
        """Commit each muscle's input."""
        for operator, u in zip(self._operators, inputs):
            operator.step(u)
