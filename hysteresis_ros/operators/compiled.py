# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What the operators have in common whose steps are compiled: a table and a memory."""

from typing import Any

import numpy as np

from .base import HysteresisOperator, sequence
from ..kernels import layout
from ..kernels.operator import peek, reset, simulate, solve, step


class CompiledOperator(HysteresisOperator):
    """
    Operator whose parameters and memory are arrays that kernels work on.

    Attributes
    ----------
    table : ndarray, shape (P,)
        Parameters as `kernels.layout` lays them out. Never changes.
    memory : ndarray, shape (Q,)
        What the operator remembers.

    """

    table: np.ndarray
    memory: np.ndarray

    # The attributes of the base class, read from the memory.
    @property
    def input(self) -> float:   # type: ignore[override]
        """Last committed input, inside the range."""
        return self.memory.item(layout.INPUT)

    @property
    def output(self) -> float:  # type: ignore[override]
        """Output that it gave."""
        return self.memory.item(layout.OUTPUT)

    @property
    def saturated(self) -> bool:    # type: ignore[override]
        """Whether the last committed input was outside the range, or not a finite number."""
        return self.memory.item(layout.SATURATED) != 0.0

    @property
    def direction(self) -> float:
        """The last movement of the input: 1.0 up, -1.0 down, 0.0 if there was none."""
        return self.memory.item(layout.DIRECTION)

    @property
    def output_range(self) -> tuple[float, float]:
        """Smallest and largest output: those at the ends of the input range."""
        return self.table.item(layout.LOW), self.table.item(layout.HIGH)

    def reset(self) -> None:
        """Forget the history: cold state, negative saturation, input at `lower`."""
        reset(self.table, self.memory)

    def step(self, u: float) -> float:
        """
        Commit an input and return the output.

        An input outside the range counts as the nearer end; NaN leaves the memory as it is.
        Both set `saturated`.
        """
        return step(self.table, self.memory, float(u))

    def peek(self, u: float) -> float:
        """Return the output that `step` would give, and commit nothing."""
        return peek(self.table, self.memory, float(u))

    def simulate(self, u: np.ndarray) -> np.ndarray:
        """
        Commit a sequence of inputs and return the outputs.

        Parameters
        ----------
        u : ndarray, shape (M,)
            Inputs, taken after those committed so far.

        Returns
        -------
        ndarray, shape (M,)
            The outputs of M calls of `step`.

        """
        return simulate(self.table, self.memory, np.ascontiguousarray(sequence(u)))

    def _solve(self, y: float) -> tuple[float, float, bool]:
        return solve(self.table, self.memory, y)

    def _used(self) -> int:
        """Return how many entries of the memory mean something."""
        return len(self.memory)

    def snapshot(self) -> np.ndarray:
        """Return the memory for `rewind`."""
        return self.memory[:self._used()].copy()

    def rewind(self, snapshot: np.ndarray) -> None:
        """Go back to a memory that `snapshot` returned."""
        self.memory[:len(snapshot)] = snapshot

    def with_memory(self, memory: np.ndarray) -> 'CompiledOperator':
        """Return a copy that remembers the same in an array of its own, shape (Q,)."""
        other = object.__new__(type(self))
        other.__dict__.update(self.__dict__)
        used = self._used()
        memory[:used] = self.memory[:used]
        other.memory = memory
        return other

    def __deepcopy__(self, memo: dict) -> 'CompiledOperator':
        """Return an operator with a memory of its own; what never changes is shared."""
        return self.with_memory(np.empty(len(self.memory)))

    def __getstate__(self) -> dict[str, Any]:
        """Return what to hand to another process: of the memory only what means something."""
        return {**self.__dict__, 'memory': (len(self.memory), self.memory[:self._used()])}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take what `__getstate__` returned."""
        size, used = state['memory']
        self.__dict__.update(state)
        self.memory = np.empty(size)
        self.memory[:len(used)] = used
