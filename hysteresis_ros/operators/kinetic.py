# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
A Preisach operator whose minor loops do not close: a share follows a transformation's kinetics.

Its major loop is that of the Preisach operator. Inside, branches of that share are scaled from
those of the major loop; see `kernels.kinetics`, where the steps are compiled.
"""

import copy
from typing import Any, Mapping

import numpy as np

from ..errors import ParameterError
from ..kernels import kinetics as kernel, layout
from ..kernels.operator import orient
from .base import memory, number, resolution, take
from .compiled import CompiledOperator
from .preisach import Preisach

# Inputs at which the branches of the major loop are laid out.
NODES = 1000


class Kinetic(CompiledOperator):
    """
    Output = (1 - share) * that of a Preisach operator + share * what kinetics make of its loop.

    Parameters
    ----------
    preisach : Preisach
        The operator with the same major loop; its memory does not count.
    share : float
        From 0, the Preisach operator itself, to 1.
    top : float
        Input at which all has transformed, where the falling branch begins. Default: the upper end
        of the range.

    Raises
    ------
    ParameterError
        If share or top is out of range.
    """

    kind = 'kinetic'

    def __init__(self, preisach: Preisach, share: float, top: float | None = None) -> None:
        self.share = number(share, 'kinetic operator: share')
        if not 0.0 <= self.share <= 1.0:
            raise ParameterError(f'kinetic operator: share is {self.share}: give one from 0 to 1')
        self.lower, self.upper = preisach.lower, preisach.upper
        self.top = self.upper if top is None else number(top, 'kinetic operator: top')
        if not self.lower < self.top <= self.upper:
            raise ParameterError(f'kinetic operator: top is {self.top}: give an input above '
                                 f'{self.lower} and up to {self.upper}')
        self.preisach = copy.deepcopy(preisach)
        self.preisach.reset()
        self.table = self._packed()
        self.memory = np.empty(kernel.INNER + len(preisach.memory))
        self.memory[kernel.ORIENTED] = 1.0
        self.reset()

    @property
    def oriented(self) -> float:
        """Share of what forms that the present load orients."""
        return self.memory.item(kernel.ORIENTED)

    def orient(self, oriented: float) -> None:
        """
        Let a load orient a share of what forms from now on.

        Parameters
        ----------
        oriented : float
            Above 0, up to 1.

        Raises
        ------
        ParameterError
            If it is out of range.
        """
        share = number(oriented, 'kinetic operator: oriented')
        if not 0.0 < share <= 1.0:
            raise ParameterError(f'kinetic operator: oriented is {share}: give one above 0 and up '
                                 'to 1')
        orient(self.table, self.memory, share)

    def simulate_under(self, u: np.ndarray, oriented: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs under loads and return the outputs.

        Parameters
        ----------
        u : ndarray, shape (M,)
            Inputs, taken after those committed so far.
        oriented : ndarray, shape (M,)
            Share of what forms that the load of each orients.

        Returns
        -------
        ndarray, shape (M,)
        """
        found = []
        for place in np.split(np.arange(len(u)), np.flatnonzero(np.diff(oriented)) + 1):
            self.orient(oriented[place[0]])
            found.append(self.simulate(u[place]))
        return np.concatenate(found)

    def _packed(self) -> np.ndarray:
        """Return the table of parameters."""
        inner, sign = self.preisach.table, float(self.preisach.table[layout.SIGN])
        base = float(inner[layout.LOW if sign > 0.0 else layout.HIGH])
        nodes = np.linspace(self.lower, self.top, NODES)
        loop = sign * (copy.deepcopy(self.preisach).simulate(
            np.concatenate((nodes, nodes[::-1]))) - base)
        most = max(float(loop[NODES - 1]), np.finfo(float).tiny)
        whole = sign * (self.preisach.peek(self.upper) - base)
        ends = sorted((base, base + sign * (whole + self.share * (most - whole))))
        branches = np.clip(loop / most, 0.0, 1.0)
        return np.concatenate((
            [layout.KINETIC, self.lower, self.upper, sign, *ends, resolution((ends[0], ends[1])),
             self.share, most, (NODES - 1) / (self.top - self.lower), NODES],
            branches[:NODES], branches[:NODES - 1:-1], inner))

    def _used(self) -> int:
        count = int(self.memory[kernel.INNER + kernel.preisach.COUNT])
        return kernel.INNER + kernel.preisach.CORNERS + 2 * count

    def _inside(self) -> Preisach:
        """Return the Preisach operator with what it remembers."""
        inner = copy.deepcopy(self.preisach)
        inner.rewind(self.memory[kernel.INNER:self._used()])
        return inner

    def save(self) -> dict[str, Any]:
        """Return the memory: the input, what has transformed, and that of the Preisach operator."""
        return {'kind': self.kind, 'input': self.input, 'saturated': self.saturated,
                'direction': self.direction,
                'transformed': self.memory.item(kernel.TRANSFORMED), 'oriented': self.oriented,
                'formed': self.memory.item(kernel.FORMED),
                'reverted': self.memory.item(kernel.REVERTED),
                'preisach': self._inside().save()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take over what `save` returned; ParameterError if it is something else."""
        u, saturated, where = memory(state, self)
        direction = number(take(state, 'direction', where), f'{where}: direction')
        shares = [number(take(state, name, where), f'{where}: {name}')
                  for name in ('transformed', 'formed', 'reverted')]
        for name, share in zip(('transformed', 'formed', 'reverted'), shares):
            if not 0.0 <= share <= 1.0:
                raise ParameterError(f'{where}: {name} is {share}, not from 0 to 1')
        oriented = number(take(state, 'oriented', where), f'{where}: oriented')
        if not 0.0 < oriented <= 1.0:
            raise ParameterError(f'{where}: oriented is {oriented}, not above 0 and up to 1')
        inner = self._inside()
        inner.restore(take(state, 'preisach', where))
        if inner.input != u:
            raise ParameterError(f'{where}: input is {u}, but {inner.input} in its part preisach')
        snapshot = inner.snapshot()
        self.memory[kernel.INNER:kernel.INNER + len(snapshot)] = snapshot
        self.memory[kernel.TRANSFORMED], self.memory[kernel.ORIENTED] = shares[0], oriented
        self.memory[kernel.FORMED], self.memory[kernel.REVERTED] = shares[1:]
        output = kernel.output(self.table, inner.output, shares[0] / oriented)
        self.memory[:layout.MEMORY] = u, output, saturated, direction

    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain types, without the memory; floats are exact."""
        return {'kind': self.kind, 'share': self.share, 'top': self.top,
                'preisach': self.preisach.to_dict()}

    @classmethod
    def from_dict(cls, parameters: Mapping[str, Any]) -> 'Kinetic':
        """Build the operator from what `to_dict` returned; ParameterError if it cannot be."""
        where = 'kinetic operator'
        return cls(Preisach.from_dict(take(parameters, 'preisach', where)),
                   take(parameters, 'share', where), take(parameters, 'top', where))
