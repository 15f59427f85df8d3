# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Discrepancy of the base model: how wrong it is by itself, as a covariance of an arm's angles.

It is known before the arm moves. With effects, their equations may be off as well.

* The bench says how large the error of the length is under each load, on trials or loads that were
  held out, and of what it consists: an error of the length at the ends of the transformation,
  another one halfway, and one of the thresholds, which goes with the slope of the response over the
  drive squared. On the arm it shows as an error of the angle that is alike at neighbouring
  responses and at drives between which the response does little, and differs between the directions
  of the drive.
* What the loads of the bench say, they say of all rows of an arm at once. A load that the bench
  lacks would change the model as one that it has does when it is left out, but by less as it is
  nearer to those that there are (`model.replicates`; Efron, The Jackknife, the Bootstrap and Other
  Resampling Plans, 1982).
* The bench holds the load still, while an arm's load moves with the wire: what a load does in the
  middle of a transformation the bench cannot tell. Models that agree on every bench table bound
  that. One of them feels the present load alone (`load_history`), in another one martensite keeps
  the strain of the load under which it formed, and a heavier one may orient it anew. By what share
  each is right is about the same for the whole wire, so that all rows err together; of the load's
  own mark, and of what is oriented anew, it may differ from place to place. Where martensite's
  memory is tried, it speaks for itself.
* A bench goes through few minor loops, which weights can follow whatever their kind. In one more
  model that agrees with it, what transforms is in proportion to what has still to (`kinetics`); by
  what share it is right is the same for all rows, too.
* Every room warms up and cools down. Where that was recorded, its course is known and only its size
  is not. As long as it is less than the errors above, it is one of them, and no answer; what moves
  the arm by more is what `ambient_temperature` is for.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.diagnosis.bench_error import (
    drive_error, length_error, length_errors, missing_load, relative_errors)
from hysteresis_ros.diagnosis.load_history import load_history
from hysteresis_ros.effects import (
    DriveEffect, Effect, Inputs, MaterialEffect, Parameter, Surroundings)
from hysteresis_ros.effects.ambient import AmbientTemperature
from hysteresis_ros.effects.base import Values
from hysteresis_ros.effects.formation_memory import FormationMemory
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.identification.bench_metrics import SHIFT
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.measurements.way import unit, way_done

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.arm_problem import ArmProblem
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.model import MuscleModel

# The error that differs between the directions of the drive, against the common one.
DIRECTIONAL = 0.5
# A share of which nothing is known, root mean square: from none to all, each as likely; and what of
# it may differ from place to place, its standard deviation.
SHARE, SHARE_SPREAD = 1.0 / math.sqrt(3.0), 1.0 / math.sqrt(12.0)
# Effects of which no bench tells the share, as the first `Discrepancy.courses` have them.
COURSES: tuple[type[Effect], ...] = (FormationMemory, Kinetics)
# Of the courses those of a changing load, of which the share may differ from place to place.
FROM_LOADS = [3, 4]
# Turns of the oscillation that stands for a bench, and rows from one to the next.
SWINGS, SWING_ROWS = 12, 5


@dataclasses.dataclass
class Discrepancy:
    """
    The base model's own error and that of effects' equations, as the parts of its covariance.

    Errors of one part are correlated between rows as these are near each other, by

        1 / sqrt(1 + d^2),

    the rational quadratic kernel with alpha = 1/2: a mixture of errors of every length from that of
    the bench's grid on (Rasmussen and Williams, Gaussian Processes for Machine Learning, eq. 4.19).

    Attributes
    ----------
    parts : ndarray, shape (n, p)
        Standard deviations of independent errors in each row, in the unit of the response.
    places : ndarray, shape (n, m)
        Where each row lies, in units of the length over which errors change.
    common : ndarray, shape (n, q)
        Errors of which each acts in all rows together, by one standard deviation.
    courses : ndarray, shape (n, c)
        What the response would change by, each with a share from none to all, which is an error of
        all rows together. On an arm: if martensite kept all of its strain; if all of it followed
        the kinetics of `Kinetics`; if martensite kept all of its strain, but each trial began with
        what the load at rest orients and not with what forms on the way down to rest; what it would
        change besides if a heavier load oriented martensite anew; and if the present load had acted
        all along (`LoadHistory.path`). Along the way of a fit the first four are those at the
        shares that explain most of its residual, over these shares.
    equations : ndarray, shape (n, e)
        The same as `parts`, for the equations of effects.
    """

    parts: np.ndarray
    places: np.ndarray
    common: np.ndarray
    courses: np.ndarray
    equations: np.ndarray

    @property
    def size(self) -> float:
        """Root mean square of the base model's own error, in the unit of the response."""
        return math.hypot(self.size_besides_courses, SHARE * math.sqrt(
            np.mean(np.sum(self.courses ** 2, axis=1))))

    @property
    def size_besides_courses(self) -> float:
        """The same without what has one course."""
        return float(np.sqrt(np.mean(np.sum(self.parts ** 2, axis=1)
                                     + np.sum(self.common ** 2, axis=1))))

    def shares(self, residual: np.ndarray, deviation: np.ndarray | float = 1.0) -> np.ndarray:
        """Return the `course_shares` that explain most of a residual (n,)."""
        return course_shares(self.courses, residual, deviation)

    def besides_courses(self, residual: np.ndarray, deviation: np.ndarray | float = 1.0
                        ) -> np.ndarray:
        """Return a residual (n,) without the `shares` of the `courses` that explain most of it."""
        return residual - self.courses @ self.shares(residual, deviation)

    def of_model_alone(self) -> Discrepancy:
        """Return the base model's own error, as if all equations of effects were exact."""
        return dataclasses.replace(self, equations=self.equations[:, :0])

    def matrix(self, courses: bool = True) -> np.ndarray:
        """Return the covariance, shape (n, n); without what has one course if not `courses`."""
        squares = np.sum(self.places ** 2, axis=1)
        gaps = squares[:, None] + squares[None, :] - 2.0 * self.places @ self.places.T
        parts = np.hstack([self.parts, self.equations])
        known = (self.common @ self.common.T
                 + (parts @ parts.T) / np.sqrt(1.0 + np.maximum(gaps, 0.0)))
        return known + SHARE ** 2 * self.courses @ self.courses.T if courses else known


def course_shares(courses: np.ndarray, residual: np.ndarray, deviation: np.ndarray | float = 1.0
                  ) -> np.ndarray:
    """
    Return the shares (c,) of courses (n, c), 0 to 1, that explain most of a residual (n,).

    In units of a standard deviation (n,) of each row, where it is given.
    """
    from scipy.optimize import lsq_linear       # a third of a second that a bench does not need
    found, acting = np.zeros(courses.shape[1]), np.any(courses, axis=0)
    if np.any(acting):
        found[acting] = lsq_linear(
            courses[:, acting] / np.reshape(deviation, (-1, 1)), residual / deviation,
            (0.0, 1.0), method='bvls').x
    return found


class Offset(MaterialEffect):
    """A constant added to the elongation, to see what an error of the length does to the angle."""

    id = 'offset'
    lasting = True
    parameters = (Parameter('size', 'm', 'what is added', 0.0, 1.0, 0.0, ()),)

    def drift(self, drive: np.ndarray, drive_squared: np.ndarray, inputs: Inputs,
              surroundings: Surroundings) -> tuple[np.ndarray, np.ndarray]:
        """Return the offset."""
        return np.full(len(drive), self.size), np.ones(len(drive))


class Shift(DriveEffect):
    """A constant added to the drive squared, to see what an error of the thresholds does."""

    id = 'shift'
    stage = 'thermal'
    lasting = True
    parameters = (Parameter('size', 'V^2', 'what is added', 0.0, 1.0, 0.0, ()),)

    def forward(self, signal: Values, inputs: Inputs, surroundings: Surroundings) -> Values:
        """Return the drive squared with it."""
        return signal + self.size


def sensitivity(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """Return how the angle follows an error of the length [rad/m], shape (n,)."""
    return _slope(Offset(size=0.01 * problem.model.surroundings.span), problem, effects)


def drive_sensitivity(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """Return how the angle follows one of all thresholds [rad per drive squared], shape (n,)."""
    return _slope(Shift(size=SHIFT * problem.model.surroundings.full_drive_squared), problem,
                  effects)


def _slope(effect: Effect, problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """Return how the response follows the size of one more effect, shape (n,)."""
    size = effect.values['size']
    up, down = problem.simulate_many(
        [[*effects, effect], [*effects, effect.with_values(size=-size)]])
    slope: np.ndarray = (up - down) / (2.0 * size)
    return slope


def discrepancy_along(problem: ArmProblem, effects: Sequence[Effect], predicted: np.ndarray,
                      settings: Settings, tried: Collection[str] = (), room: bool = False,
                      residual: np.ndarray | None = None) -> Discrepancy:
    """
    Return the base model's own error of the angle, along the way that the arm takes.

    How much strain martensite keeps, and how much of it follows its kinetics, is not known from the
    bench. Where `formation_memory` or `kinetics` is in the model or tried, its parameter stands for
    that, and a set without it says that it is none; otherwise anything from none to all may be.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model, which say where the arm goes.
    predicted : ndarray, shape (n,)
        Response with them.
    settings : Settings
    tried : collection of str
        Identifiers of all effects that may explain the recording.
    room : bool
        Whether what the recorded room does is one of the errors; see `room_is_calm`.
    residual : ndarray, shape (n,), optional
        Of the fit whose way it is: the `courses` are those at the shares that explain most of it,
        over these shares. What a play or a stop makes of a half is not half of what it makes of
        all.

    Returns
    -------
    Discrepancy
    """
    gain, history = sensitivity(problem, effects), load_history(problem, effects)
    direction = np.ones(len(predicted))
    if 'direction' in problem.signals:
        direction = np.where(problem.signals['direction'] > 0.0, 1.0, -1.0)
    length = length_errors(problem.model, history.load) / math.sqrt(1.0 + DIRECTIONAL ** 2)
    bench = length * gain * relative_errors(problem.model, history.martensite)
    thresholds = drive_error(problem.model)
    if thresholds:
        bench = np.hypot(bench, length * thresholds * drive_sensitivity(problem, effects))
    drive = problem.signals.get('drive', np.zeros(len(predicted)))
    known = {*tried, *(effect.id for effect in effects)}
    courses = np.column_stack([_courses_along(problem, effects, known), history.path])
    if residual is not None:
        courses[:, :-1] = _courses_along(
            problem, effects, known, course_shares(courses, residual).tolist())
    parts = np.column_stack([bench, DIRECTIONAL * direction * bench,
                             SHARE_SPREAD * courses[:, FROM_LOADS],
                             kinetics_spread(problem, effects)])
    common = left_out_changes(problem, effects, history.load)
    if room:
        common = np.column_stack([common, room_change(problem, effects)])
    return Discrepancy(
        parts, np.column_stack([way_done(drive, predicted, problem.trial), unit(predicted)])
        / settings.correlation, common, courses, np.zeros((len(predicted), 0)))


def _courses_along(problem: ArmProblem, effects: Sequence[Effect], known: Collection[str],
                   shares: Sequence[float] = (1.0,) * 5) -> np.ndarray:
    """
    Return the `courses` but for the last one, shape (n, 4); 0 for effects that are `known`.

    Each is that of its own share, over the share; what a heavier load orients is that of what is
    kept.
    """
    kept, kinetics = (
        np.zeros(len(problem.measured)) if kind.id in known or not kind.available(
            problem.model.surroundings) else course_of(kind, problem, effects, share)
        for kind, share in zip(COURSES, shares))
    hung_cold = anew = kept
    if np.any(kept):
        whole = min(shares[0] + shares[2], 1.0)
        hung_cold, anew, likewise = (
            course_of(FormationMemory, problem, effects, share, **form) for share, form in (
                (shares[2], {'cooled': 0.0}), (whole, {'anew': 1.0}), (whole, {})))
        anew = anew - likewise
    return np.column_stack([kept, kinetics, hung_cold, anew])


def course_of(kind: type[Effect], problem: ArmProblem, effects: Sequence[Effect],
              share: float = 1.0, **others: float) -> np.ndarray:
    """
    Return what the response would change by if all of the wire did what one of `COURSES` says.

    Parameters
    ----------
    kind : type of Effect
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model, none of this kind among them.
    share : float
        How much of the wire does it: what that changes is divided by it. Of a share that is too
        small to count it is that of all.
    **others : float
        Values of other parameters than the share.

    Returns
    -------
    ndarray, shape (n,)
    """
    size = kind.parameters[0]
    share = share if share >= size.low else 1.0
    return _change_by(kind(problem.model.surroundings, **{size.name: share}, **others), problem,
                      effects) / share


def kinetics_spread(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """
    Return how much the response may be off where part of the wire follows its kinetics.

    Of a share s that does, each place may be one that does or one that does not, with a variance of
    s (1 - s) about their mean. A wire all of which does has no such places. On a bench the same
    would show as an error of the length: what is more than that has shown is not there.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model.

    Returns
    -------
    ndarray, shape (n,)
        Standard deviation times the change by all of the kinetics; 0 without kinetics.
    """
    own = next((effect for effect in effects if isinstance(effect, Kinetics)), None)
    if own is None or not 0.0 < own.share < 1.0:
        return np.zeros(len(problem.measured))
    others = [effect for effect in effects if effect is not own]
    change = _change_by(own.with_values(share=1.0), problem, others)
    spread = math.sqrt(own.share * (1.0 - own.share))
    on_bench, shown = spread * _kinetics_on_bench(problem.model, own), length_error(problem.model)
    return (shown / on_bench if 0.0 < shown < on_bench else 1.0) * spread * change


def _kinetics_on_bench(model: MuscleModel, own: Kinetics) -> float:
    """Return what all of the kinetics change on a bench, root mean square of the length [m]."""
    low, high = model.ranges[model.drive]
    loads = model.metrics.get('length', {}).get('identification', {}).get(
        'loads') or [model.surroundings.load]
    ends = 0.5 + 0.5 * np.linspace(1.0, 0.0, SWINGS) * (-1.0) ** np.arange(1, SWINGS + 1)
    course = np.interp(np.arange(SWINGS * SWING_ROWS) / SWING_ROWS, np.arange(SWINGS), ends)
    rows = len(course)
    bench = Measurement.from_columns({
        'trial': np.repeat(np.arange(len(loads)), rows),
        'step': np.tile(np.arange(rows), len(loads)),
        model.drive: low + (high - low) * np.tile(course, len(loads)),
        'force': np.repeat(loads, rows), 'length': np.zeros(rows * len(loads))})
    others = [effect for effect in model.effects
              if effect.id != own.id and 'bench' in effect.kinds]
    without, whole = (model.with_effects(effects).predict(bench) for effects in (
        others, [*others, own.with_values(share=1.0)]))
    return float(np.sqrt(np.mean((whole - without) ** 2)))


def _change_by(effect: Effect, problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """Return what one more effect than some changes the response by, shape (n,)."""
    own, changed = problem.simulate_many([effects, [*effects, effect]])
    change: np.ndarray = changed - own
    return change


def left_out_changes(problem: ArmProblem, effects: Sequence[Effect], load: np.ndarray
                     ) -> np.ndarray:
    """
    Return what the response may be off by for what each of the bench's loads says.

    What it would change by without that load, in proportion to how far the arm's load is from those
    that there are. Divided by the root of their number, so that the sum of their squares is the
    mean square.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model.
    load : ndarray, shape (n,)
        Tension of each muscle [N].

    Returns
    -------
    ndarray, shape (n, R)
    """
    responses = problem.simulate_replicates(effects)
    own, = problem.simulate_many([effects])
    changes: np.ndarray = ((responses - own) / math.sqrt(max(len(responses), 1))).T
    return changes * missing_load(problem.model, load)


def room_is_calm(problem: ArmProblem, discrepancy: Discrepancy) -> bool:
    """Return whether what the recorded room does is less than the model's own error without it."""
    change = room_change(problem, problem.model.effects)
    return 0.0 < float(np.sqrt(np.mean(change ** 2))) < discrepancy.size_besides_courses


def room_change(problem: ArmProblem, effects: Sequence[Effect]) -> np.ndarray:
    """
    Return what the recorded room typically does to the response, shape (n,).

    Against the bench's where that was recorded, else about its own mean: what a room does that is
    as warm all the time is not known without the bench's.

    Parameters
    ----------
    problem : ArmProblem
        Rows and model.
    effects : sequence of Effect
        All effects of the model.
    """
    surroundings = problem.model.surroundings
    recorded = problem.ambient[np.isfinite(problem.ambient)]
    if (not len(recorded) or not AmbientTemperature.available(surroundings)
            or any(effect.id == AmbientTemperature.id for effect in effects)):
        return np.zeros(len(problem.measured))
    bench = AmbientTemperature.column_on_bench(surroundings)
    return _change_by(AmbientTemperature.typical(
        surroundings, float(np.mean(recorded)) if bench is None else bench), problem, effects)
