# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The martensite share of a whole trial that is the same as the one that its effects cause.

Found in passes over all rows: the share that a response has is given to the effects that depend on
it, until both agree (Anderson's acceleration of a fixed point; Walker and Ni, SIAM J. Numer. Anal.
49 (2011) 1715).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import copy
import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import Effect

if TYPE_CHECKING:
    from hysteresis_ros.model.chain import Chain
    from hysteresis_ros.model.simulation import Response
    from hysteresis_ros.model.trials import Trial

# Passes that each one looks back at.
LOOK_BACK = 6
# Runs whose phase is kept, each a number a row.
MOST_KEPT = 500


class KnownPhases:
    """
    The martensite share of every row in runs with sets of effects.

    Parameters
    ----------
    phase : ndarray, shape (rows,)
        That to begin with.
    """

    def __init__(self, phase: np.ndarray) -> None:
        self._phases: deque[np.ndarray] = deque([phase], MOST_KEPT)
        # Of each run the values of all parameters that have occurred, NaN of those absent, and how
        # many it has.
        self._places: dict[tuple[str, str], int] = {}
        self._values, self._sizes = np.zeros((1, 0)), np.zeros(1)

    def copy(self) -> KnownPhases:
        """Return what is known now, to go back to."""
        other = copy.copy(self)
        other._phases, other._places = self._phases.copy(), dict(self._places)
        return other

    def keep(self, effects: Sequence[Effect], phase: np.ndarray | None) -> None:
        """Keep the phase (rows,) of a run, if it has needed one."""
        if phase is None:
            return
        for effect in effects:
            for name in effect.values:
                self._places.setdefault((effect.id, name), len(self._places))
        row = self._row(effects)
        missing = np.full((len(self._values), len(row) - self._values.shape[1]), np.nan)
        self._values = np.vstack((np.hstack((self._values, missing)), row))[-MOST_KEPT:]
        self._sizes = np.append(self._sizes, np.sum(np.isfinite(row)))[-MOST_KEPT:]
        self._phases.append(phase)

    def nearest(self, effects: Sequence[Effect]) -> np.ndarray:
        """Return the phase (rows,) of the run with the most similar effects, of these the last."""
        row = self._row(effects)
        own = np.flatnonzero(np.isfinite(row))
        values, known = row[own], self._values[:, own]
        with np.errstate(invalid='ignore', divide='ignore'):
            apart = np.nan_to_num(np.abs(known - values) / (np.abs(known) + np.abs(values)))
        # A value that only one of the two has counts 1: as many as both have, of which these are
        # the same for all runs, less twice those in common.
        apart -= 2.0 * np.isfinite(known)
        return self._phases[-1 - int(np.argmin((self._sizes + np.sum(apart, axis=1))[::-1]))]

    def _row(self, effects: Sequence[Effect]) -> np.ndarray:
        row = np.full(len(self._places), np.nan)
        for effect in effects:
            for name, value in effect.values.items():
                place = self._places.get((effect.id, name))
                if place is not None:
                    row[place] = value
        return row


class Agreement:
    """
    The phase of one trial on its way to the one that the response to it has.

    Never after one pass alone, whose response would be that of the phase given.
    """

    response: Response

    def __init__(self, trial: Trial, phase: np.ndarray, agreement: float) -> None:
        self.trial, self.phase = trial, phase
        self.searching, self.agrees = True, False
        self._agreement = agreement
        self._phases: list[np.ndarray] = []
        self._residuals: list[np.ndarray] = []

    def driven(self) -> Trial:
        """Return the trial with the phase to try."""
        return dataclasses.replace(
            self.trial, inputs=self.trial.inputs._replace(phase=self.phase))

    def take(self, response: Response, caused: np.ndarray, chain: Chain) -> None:
        """Take the response of a chain to the phase, and the phase (rows,) that it has."""
        self.response, residual = response, caused - self.phase
        self.searching, self.agrees = True, False
        if self._phases and np.sqrt(np.mean(residual ** 2)) < self._agreement:
            self.searching, self.agrees = False, True
        elif not np.all(np.isfinite(residual)):
            self.searching = False
        else:
            # What works against its cause would swing to and fro.
            first = 0.5
            if chain.latent is not None:
                dt = np.broadcast_to(self.trial.inputs.dt, caused.shape)
                residual = chain.latent.agreeing_phase(
                    self.phase, caused, response.drive_squared, dt, chain.surroundings) - self.phase
                first = 1.0
            self._phases.append(self.phase)
            self._residuals.append(residual)
            self.phase = np.clip(_next_phase(self._phases[-LOOK_BACK:],
                                             self._residuals[-LOOK_BACK:], first), 0.0, 1.0)


def _next_phase(phases: Sequence[np.ndarray], residuals: Sequence[np.ndarray], first: float
                ) -> np.ndarray:
    """
    Return the phase to try after some with their residuals, by Anderson's acceleration.

    Of a single residual a share `first` is taken.
    """
    if len(phases) == 1:
        return phases[0] + first * residuals[0]
    steps, changes = np.diff(phases, axis=0).T, np.diff(residuals, axis=0).T
    parts = np.linalg.lstsq(changes, residuals[-1], rcond=1e-10)[0]
    return phases[-1] + residuals[-1] - (steps + changes) @ parts
