# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands of the terminal that repeat what was done on the page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import dataclasses
import shlex
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hysteresis_ros.effects import Effect
    from hysteresis_ros.studio.parts import Part


@dataclasses.dataclass(frozen=True)
class Source:
    """
    Where model and recordings came from.

    Attributes
    ----------
    model : str
        The model's file.
    recordings : sequence of str
        Files and folders.
    reading : tuple of str
        Options that say how recordings are read.
    """

    model: str
    recordings: Sequence[str]
    reading: tuple[str, ...] = ()

    def compare(self, model: str = '', report: str = '') -> str:
        """Return the command that compares this model, or another one, with all recordings."""
        return self._join('compare', model or self.model, '--data', *self.recordings,
                          *self.reading, *_report(report))

    def diagnose(self, parts: Sequence[Part], unseen: Sequence[Part], report: str = '') -> str:
        """Return the command that diagnoses the parts that are not unseen."""
        return self._join('diagnose', self.model, *self._parts(parts, unseen, test=False),
                          *_report(report))

    def extend(self, effects: Sequence[Effect], parts: Sequence[Part], unseen: Sequence[Part],
               output: str, *, fitted: bool, force: bool = False, report: str = '') -> str:
        """
        Return the command that adds effects.

        Parameters
        ----------
        effects : sequence of Effect
            With their values.
        parts, unseen : sequence of Part
            All, and those that are not fitted.
        output : str
            The extended model's file.
        fitted : bool
            Whether the command fits the values, or takes those that the effects have.
        force : bool
            Whether effects are fitted that the recordings cannot show.
        report : str
            The page's file.
        """
        by_hand: list[str] = []
        if not fitted:
            by_hand = ['--values', ','.join(
                f'{effect.id}.{name}={value:.12g}' for effect in effects
                for name, value in effect.values.items())]
        return self._join('extend', self.model, '--add', ','.join(e.id for e in effects),
                          *self._parts(parts, unseen), *by_hand, *['--force'] * (force and fitted),
                          '-o', output, *_report(report))

    def _parts(self, parts: Sequence[Part], unseen: Sequence[Part],
               test: bool = True) -> list[str]:
        """Return the options that say which rows are fitted and which are not."""
        kept = [part for part in parts if part not in unseen]
        if parts and parts[0].trial is not None:
            chosen = ['--trials', _trials(part.trial for part in kept)] if unseen else []
            return ['--data', *self.recordings, *self.reading, *chosen]
        words = ['--data', *(self.recordings[part.recording] for part in kept), *self.reading]
        if unseen and test:
            words += ['--test', *(self.recordings[part.recording] for part in unseen)]
        return words

    @staticmethod
    def _join(command: str, model: str, *words: str) -> str:
        return shlex.join(['hysteresis', command, '--model', model, *words])


def _report(path: str) -> list[str]:
    return ['--report', path] if path else []


def _trials(trials: Iterable[float | None]) -> str:
    return ','.join(f'{trial:g}' for trial in trials)
