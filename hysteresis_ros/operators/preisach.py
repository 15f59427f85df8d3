# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Preisach operator of Eqs. 3 to 6, with exact areas, and its exact inverse.

The relays that are up fill the Preisach plane below a staircase whose corners are the reversals
of the input that nothing has wiped out since. The output moves with the weight between the last
corner and the present input (`everett`), so one stack of corners with the sums up to each of
them is the whole memory, and a step costs amortised constant time however long the history is.
The steps themselves are compiled: `kernels.preisach`.
"""

from typing import Any, Mapping

import numpy as np

from ..errors import ParameterError
from ..kernels import layout, preisach as kernel
from .areas import signed_areas
from .base import LARGEST, memory, number, numbers, one_sign, resolution, take
from .compiled import CompiledOperator
from .everett import check_nodes, everett_table
from .staircase import MOST_CORNERS, check_corners


class Preisach(CompiledOperator):
    """
    Preisach operator with a piecewise constant weight of one sign.

    Output = sum over the cells of weight times signed area + bias (Eq. 6), and optionally + sum
    over the intervals of reversible weight times signed length: relays without a loop, on the line
    beta = alpha. Cells alone, however small their weight's loop should be, make loops of their own
    width, and leave a branch with slope zero where it turns.

    Parameters
    ----------
    nodes : array_like, shape (N + 1,)
        Inputs at which the weight may jump, strictly increasing; the input range is from the
        first to the last.
    weights : array_like, shape (N (N + 1) / 2,)
        Weight of each cell in the order of Eq. 8, all >= 0 or all <= 0 (then the output falls
        when the input rises). Unit of the output over the square of the unit of the input.
    bias : float
        The constant c of Eqs. 3 and 6.
    reversible : array_like, shape (N,), optional
        Weights on the line beta = alpha, one an interval, of the same sign; every branch has at
        least twice this slope there. Unit of the output over the unit of the input. Default 0.

    Raises
    ------
    ParameterError
        If nodes are not increasing, there are more or fewer weights than cells, the signs are
        mixed, or a value is not finite.

    """

    kind = 'preisach'

    def __init__(self, nodes: np.ndarray, weights: np.ndarray, bias: float = 0.0,
                 reversible: np.ndarray | None = None) -> None:
        self.nodes = check_nodes(nodes)
        levels = len(self.nodes) - 1
        self.weights = _check_weights(weights, levels)
        self.reversible = numbers(
            np.zeros(levels) if reversible is None else reversible, 'Preisach reversible weights')
        if len(self.reversible) != levels:
            raise ParameterError(f'Preisach reversible weights: {len(self.reversible)} given for '
                                 f'{levels} levels')
        self.bias = number(bias, 'Preisach bias')
        self.lower, self.upper = float(self.nodes[0]), float(self.nodes[-1])
        self._sign = one_sign(
            np.concatenate((self.weights, self.reversible)), 'Preisach weights')
        self.table = self._packed()
        self.memory = np.empty(kernel.memory_size(MOST_CORNERS))
        self.reset()
        for array in (self.nodes, self.weights, self.reversible):
            array.flags.writeable = False

    def _packed(self) -> np.ndarray:
        """Return the table of parameters."""
        # The output is base + sign * z with z from 0, all relays down, to span, all up.
        everett, span = everett_table(
            self.nodes, 2.0 * np.abs(self.weights), 2.0 * np.abs(self.reversible))
        base = self.bias - self._sign * span / 2.0
        if not span + abs(base) <= LARGEST:
            raise ParameterError(
                f'Preisach operator: the output reaches beyond {LARGEST:g}, use another unit')
        low, high = sorted((base, base + self._sign * span))
        levels = len(self.nodes) - 1
        return np.concatenate((
            [layout.PREISACH, self.lower, self.upper, self._sign, low, high,
             resolution((low, high)), levels, base, span, levels / (self.upper - self.lower)],
            everett))

    def _used(self) -> int:
        return kernel.CORNERS + 2 * int(self.memory[kernel.COUNT])

    @property
    def _corners(self) -> list[float]:
        """The whole staircase, outside in, beginning with the ends of the range."""
        return self.memory[kernel.CORNERS:self._used():2].tolist()

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        count = int(self.memory[kernel.COUNT])
        if self.input == self.memory[kernel.CORNERS + 2 * (count - 1)]:
            return 0.0
        return -1.0 if count & 1 else 1.0

    @property
    def corners(self) -> list[float]:
        """Reversals that the memory holds: maximum, minimum, maximum, ... outside in."""
        return self._corners[2:]

    def save(self) -> dict[str, Any]:
        """Return the memory: the present input and the corners, outside in."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'corners': self.corners}

    def restore(self, state: Mapping[str, Any]) -> None:
        """
        Take over a memory that `save` returned.

        Raises
        ------
        ParameterError
            If it is no memory of a Preisach operator on this input range.

        """
        u, saturated, where = memory(state, self)
        corners = numbers(take(state, 'corners', where), f'{where}: corners').tolist()
        corners = check_corners(corners, u, self.lower, self.upper, where)
        self.memory[kernel.CORNERS:kernel.CORNERS + 2 * len(corners):2] = corners
        self.memory[kernel.COUNT] = len(corners)
        kernel.recall(self.table, self.memory, u)
        self.memory[layout.SATURATED] = saturated

    def take_over(self, other: 'Preisach') -> None:
        """
        Go on with what an operator with other weights, maybe on fewer nodes, has been through.

        Only corners are known of that. Relays that it lacks below its range have seen the largest
        input of these, the upper end if there is none, and then the lower one.
        """
        self.reset()
        corners = other.corners
        largest = corners[0] if corners else other.upper
        self.simulate(np.array([largest, other.lower, *corners, other.input]))

    def areas(self, inputs: np.ndarray) -> np.ndarray:
        """Return the signed areas after inputs from the cold state, shape (M, cells)."""
        return signed_areas(self.nodes, inputs)

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'nodes': self.nodes.tolist(),
                'weights': self.weights.tolist(), 'bias': self.bias,
                'reversible': self.reversible.tolist()}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'Preisach':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        where = 'Preisach operator'
        return cls(take(parameters, 'nodes', where), take(parameters, 'weights', where),
                   take(parameters, 'bias', where), parameters.get('reversible'))


def _check_weights(weights: np.ndarray, levels: int) -> np.ndarray:
    """Return weights, one a cell, as a checked array."""
    array = numbers(weights, 'Preisach weights')
    if len(array) != levels * (levels + 1) // 2:
        raise ParameterError(
            f'Preisach weights: {len(array)} given, {levels} levels have '
            f'{levels * (levels + 1) // 2} cells')
    return array
