# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which operator describes a muscle best, and what it costs: operators side by side.

Each is fitted anew with a part of the length table held out in turn: whole trials, because memory
is wiped between them, or, of one trial alone, blocks of rows, through which the memory is carried.
The paper's advice (Sec. VIII) is many parameters where accuracy counts and few where cost does, so
the answer names the smallest error, and the fewest parameters among those that cannot be told from
it: whose error over the smallest one, as a mean logarithm over the parts held out, is at most its
standard error above 0. Of ratios, because a part that has to be extrapolated would else outweigh
all others. What has a larger error than a model with no more parameters is never advised.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.candidates import (
    Candidate, candidates, FittedModel, Fold, inputs_of)
from hysteresis_ros.identification.least_squares import folds_of
from hysteresis_ros.identification.operators import thinned
from hysteresis_ros.identification.timing import time_per_step

if TYPE_CHECKING:
    from hysteresis_ros.measurements import Measurement

# Rows of the length table that are looked at: about so many, and every turning point.
MOST_ROWS = 3000
# Errors below this share of the range are the same.
EXACT = 1e-6


@dataclasses.dataclass(frozen=True)
class Score:
    """
    One operator's row of the table.

    Attributes
    ----------
    name : str
    held_out, fitted : float
        RMSE on rows held out, and on the rows of the same fits. Unit of the response.
    parts : ndarray, shape (folds,)
        RMSE on each part held out.
    parameters : int
        Numbers that the model stores.
    simulate_us, invert_us : float
        Time of one row of a sequence, and of one scalar inverse with its commit, in microseconds.
    options : str
        Of `hysteresis identify`, by which it is identified; '' if there are none.
    """

    name: str
    held_out: float
    fitted: float
    parts: np.ndarray
    parameters: int
    simulate_us: float
    invert_us: float
    options: str = ''


@dataclasses.dataclass(frozen=True)
class Choice:
    """
    Operators side by side.

    Attributes
    ----------
    scores : list of Score
        The smallest error on rows held out first.
    left_out : dict of str to str
        Operators that could not be fitted, and why.
    best, simplest : Score
        The smallest error; the fewest parameters within its uncertainty.
    response : str
        'length' or 'strain'.
    span : float
        Range of the response.
    rows, used : int
        Rows of the length table, and how many of them were looked at.
    parts : str
        What was held out in turn: 'trials' or 'blocks'.
    folds : int
        How many parts there were.
    """

    scores: list
    left_out: dict
    best: Score
    simplest: Score
    response: str
    span: float
    rows: int
    used: int
    parts: str
    folds: int

    def to_dict(self) -> dict:
        """Return plain types for JSON."""
        percent = 100.0 / self.span
        return {
            'quantity': self.response, 'unit': 'm' if self.response == 'length' else '1',
            'rows': self.rows, 'rows_used': self.used, 'held_out': self.parts,
            'folds': self.folds,
            'operators': [{
                'operator': score.name, 'parameters': score.parameters,
                'held_out': {'rmse': score.held_out, 'rmse_percent': percent * score.held_out,
                             'parts': score.parts.tolist()},
                'fitted': {'rmse': score.fitted, 'rmse_percent': percent * score.fitted},
                'simulate_us': score.simulate_us, 'invert_us': score.invert_us}
                for score in self.scores],
            'left_out': self.left_out, 'best': self.best.name, 'simplest': self.simplest.name}


def compare_operators(length: Measurement, force: Measurement | None = None,
                      chosen: list[Candidate] | None = None,
                      progress: Callable = lambda items, total: items) -> Choice:
    """
    Fit operators with parts of a length table held out, and say what they cost.

    Parameters
    ----------
    length : Measurement
        Drive, load where there is one, and length or strain.
    force : Measurement, optional
        Drive and force at resting length, from which two-stage models get H1.
    chosen : list of Candidate, optional
        Operators; by default all that these tables allow.
    progress : callable
        ``progress(iterable, total)``, for a progress bar.

    Returns
    -------
    Choice

    Raises
    ------
    IdentificationError
        If no operator could be fitted.
    """
    table = _reduced(length)
    trial = table.column('trial')
    masks = folds_of(trial)
    parts = 'trials' if len(np.unique(trial)) > 1 else 'blocks'
    chosen, left_out = candidates(table, force, parts == 'trials') if chosen is None else (
        chosen, {})
    scores = []
    for candidate in progress(chosen, len(chosen)):
        try:
            scores.append(_score(candidate, table, force, masks, parts))
        except IdentificationError as error:
            left_out[candidate.name] = str(error)
    if not scores:
        reasons = '; '.join(f'{name}: {reason}' for name, reason in left_out.items())
        raise IdentificationError(f'{length.source}: no operator could be fitted: {reasons}')
    scores.sort(key=lambda score: score.held_out)
    best = scores[0]
    span = float(np.ptp(table.column(table.response)))
    near = [score for score in scores if _alike(score.parts, best.parts, EXACT * span)
            and not any(other.held_out < score.held_out and other.parameters <= score.parameters
                        for other in scores)]
    return Choice(
        scores, left_out, best, min(near, key=lambda score: score.parameters), table.response,
        span, length.rows, table.rows, parts, len(masks))


def _alike(errors: np.ndarray, smallest: np.ndarray, least: float) -> bool:
    """Tell whether errors on the parts held out are within a standard error of the smallest."""
    ratios = np.log(np.maximum(errors, least) / np.maximum(smallest, least))
    return bool(np.mean(ratios) <= np.std(ratios, ddof=1) / np.sqrt(len(ratios)))


def _reduced(length: Measurement) -> Measurement:
    """Return the table with about `MOST_ROWS` rows, every turning point among them."""
    if length.rows <= MOST_ROWS:
        return length
    drive = length.column(length.drive)
    share = MOST_ROWS / length.rows
    kept = [part.start + thinned(drive[part], max(1, round(share * (part.stop - part.start))))
            for _, part in length.split()]
    return length.where(np.concatenate(kept))


def _score(candidate: Candidate, table: Measurement, force: Measurement | None,
           masks: Sequence[np.ndarray], parts: str) -> Score:
    """Fit a candidate without each part in turn, and return its row of the table."""
    measured = table.column(table.response)
    held_out, fitted, errors = 0.0, 0.0, []
    for mask in masks:
        if parts == 'trials':
            fold = Fold(table.where(~mask), force, None)
        else:
            fold = Fold(table, force, ~mask)
        model = candidate.fit(fold)
        predicted = np.concatenate([_simulated(model, one) for one in inputs_of(model, table)])
        square = (predicted - measured) ** 2
        held_out += float(np.sum(square[mask]))
        fitted += float(np.mean(square[~mask]))
        errors.append(float(np.sqrt(np.mean(square[mask]))))
    first = inputs_of(model, table)[0]
    simulate, invert = time_per_step(model.operator, first, _simulated(model, first))
    return Score(candidate.name, float(np.sqrt(held_out / len(measured))),
                 float(np.sqrt(fitted / len(masks))), np.array(errors), model.parameters,
                 1e6 * simulate, 1e6 * invert, candidate.options)


def _simulated(model: FittedModel, inputs: np.ndarray) -> np.ndarray:
    """Return the outputs of one trial without that of the cold state, shape (rows,)."""
    model.operator.reset()
    return model.operator.simulate(inputs)[1:]
