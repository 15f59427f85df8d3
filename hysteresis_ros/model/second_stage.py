# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The second stage as a controller needs it: one muscle, or parallel ones of unequal length."""

from collections.abc import Mapping, Sequence
import copy
from typing import Any

import numpy as np

from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.kernels import formation
from hysteresis_ros.kernels.load_play import held
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.operators import HysteresisOperator, Kinetic

# Elongation [m] by which elastic wires may leave the range of the transformation.
ELASTIC_ROOM = 0.02


class SecondStage:
    """
    H2 with its memory: ``output = H2[sign (x - load)]``, and the inverse for x (Eq. 13).

    Where the load widens the loop, the input of H2 is that of `kernels.load_play`. Where martensite
    keeps strain (`kernels.formation`), the output counts as that which would give the elongation
    if all of it had the strain of the present load.

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
        self._kept, self._orients = chain.keeps_strain, chain.orients
        self._anew = chain.oriented_anew
        # The columns of `kernels.formation`, for each muscle.
        self._muscles = (self._bundle.muscles if self._bundle
                         else np.zeros((1, formation.SIZE)))
        self._sign = sign
        self.base, self._top = operator.output_range
        self._room = max(abs(excess) for excess in chain.offsets) + ELASTIC_ROOM

    def reset(self) -> None:
        """Wipe the memory."""
        for operator in self._operators:
            operator.reset()
        self._muscles[:] = 0.0

    def save(self) -> list[dict[str, Any]]:
        """Return the memory as plain types."""
        saved = [operator.save() for operator in self._operators]
        if not self._kept:
            return saved
        return [{**entry, 'formation': muscle} for entry, muscle in zip(
            saved, self._muscles.tolist())]

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
        if self._kept:
            self._muscles[:] = [_muscle_of(entry) for entry in state]

    def settle_cold(self, x: float, load: float, cold: np.ndarray | None = None) -> None:
        """
        Start from the cold state.

        Parameters
        ----------
        x, load : float
            Output of the first stage, and load that is borne, both cold.
        cold : ndarray, shape (muscles, 5), optional
            What the muscles start from, where that is known better.
        """
        self.reset()
        self.step(self.respond(x, load)[1] if cold is None else cold)

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
        self._orient(float(self._chain.oriented(np.float64(load))))
        found = operator.invert(self.given(output, load), dead_band=dead_band)
        play = width if found.input > operator.input else 0.0
        return self._sign * found.input + inside - play, found.saturated

    def given(self, output: float, load: float) -> float:
        """Return what H2 itself gives for an output [m] under a load; of several their mean."""
        if not self._kept or self._bundle is not None:
            return output
        scale = self._scale(load)
        return self.base + formation.output_for(
            self._kept, self._muscles, 0, scale * (output - self.base), scale)

    def _scale(self, load: float) -> float:
        return float(self._chain.scale(np.float64(load)))

    def respond(self, x: float, load: float) -> tuple[float, np.ndarray]:
        """Return the output [m] and what `step` would commit, shape (muscles, 5)."""
        inside, width = self._felt(load)
        if self._bundle is not None:
            return self._bundle.respond(
                x, inside, self.base - self._room, self._top + self._room, self.base)
        u = self._sign * (x - inside)
        if width > 0.0:
            u = held(self._operators[0].input, u, width)
        oriented = float(self._chain.oriented(np.float64(load)))
        self._orient(oriented)
        output, following = self._operators[0].peek(u), self._muscles.copy()
        following[0, formation.LOAD], following[0, formation.ORIENTED] = u, oriented
        if not self._kept:
            return output, following
        given, scale = output - self.base, self._scale(load)
        strained, kept = formation.parts(self._kept, self._muscles, 0, given)
        formation.keep(following, 0, given, scale, self._anew)
        return self.base + strained + kept / scale, following

    def _orient(self, *oriented: float) -> None:
        """Let the load of each muscle orient a share of what forms, where that depends on it."""
        if self._orients:
            for operator, share in zip(self._operators, oriented):
                if isinstance(operator, Kinetic):
                    operator.orient(share)

    def _felt(self, load: float) -> tuple[float, float]:
        """Return a load as the transformation feels it, and by how much it widens the loop."""
        if not self._loaded:
            return 0.0, 0.0
        felt = np.float64(load)
        return float(self._chain.load_inside(felt)), float(self._chain.loop_width(felt))

    def step(self, following: np.ndarray) -> None:
        """Commit each muscle's input of H2, and what its martensite keeps, shape (muscles, 5)."""
        self._orient(*following[:, formation.ORIENTED].tolist())
        for operator, u in zip(self._operators, following[:, formation.LOAD].tolist()):
            operator.step(u)
        if self._kept:
            self._muscles[:] = following


def _muscle_of(entry: Mapping[str, Any]) -> np.ndarray:
    """Return what was saved of a muscle, (5,); KeyError or ValueError if that is damaged."""
    muscle = np.array(entry['formation'], dtype=float)
    if muscle.shape != (formation.SIZE,) or not np.all(np.isfinite(muscle)):
        raise ValueError(f'formation is {entry["formation"]}')
    return muscle
