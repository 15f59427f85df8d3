# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress of work in rounds: one bar with the name of the round, and one time left."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
import sys
from typing import Any, TextIO, TypeVar

Item = TypeVar('Item')

# What the steps of a diagnosis of an arm do.
STEPS = {'_score': 'scoring effects and pairs', '_fit_alone': 'fitting each effect alone',
         '_grow_sets': 'growing sets of effects'}
BENCH = ('each effect alone', 'sets of effects')
"""Rounds of a diagnosis of bench tables."""


class Rounds:
    """
    Iterates over rounds of work with one bar on a terminal, silently elsewhere.

    A round that begins adds to the total, so that the rate, and with it the time left, goes on from
    the rounds before.

    Parameters
    ----------
    names : sequence of str
        What the rounds do, in their order; further ones are numbered.
    stream : file, optional
        Standard error by default.

    """

    def __init__(self, names: Sequence[str] = (), stream: TextIO | None = None) -> None:
        self.names = names
        self.stream = stream or sys.stderr
        self.begun = 0
        self._bar: Any = None

    def __call__(self, items: Iterable[Item], total: int) -> Iterable[Item]:
        """Return the items of a round; `total` is their number."""
        if not self.stream.isatty():
            return items
        try:
            from tqdm import tqdm
        except ImportError:
            return items
        name = (self.names[self.begun] if self.begun < len(self.names)
                else f'round {self.begun + 1}')
        self.begun += 1
        if self._bar is None:
            # Beside its thread, which wakes up bars that stand still, no process is forked.
            tqdm.monitor_interval = 0
            # Without smoothing the time left rests on all that was done so far.
            self._bar = tqdm(total=0, file=self.stream, leave=False, smoothing=0)
        self._bar.total += total
        self._bar.set_description(name)
        return self._advance(items)

    def _advance(self, items: Iterable[Item]) -> Iterator[Item]:
        for item in items:
            step = STEPS.get(getattr(item, '__name__', ''))
            if step:
                self._bar.set_description(step)
            yield item
            self._bar.update()

    def close(self) -> None:
        """Take the bar off the terminal."""
        if self._bar is not None:
            self._bar.close()
