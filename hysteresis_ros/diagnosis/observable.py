# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Which effects of the catalogue a recording can show at all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.effects import catalogue, Effect

if TYPE_CHECKING:
    from hysteresis_ros.diagnosis.problem import Problem
    from hysteresis_ros.model import MuscleModel


def observable(problem: Problem) -> tuple[list[str], dict[str, str]]:
    """
    Divide the catalogue into effects to try and effects that this data cannot show.

    Parameters
    ----------
    problem : Problem
        Rows and model.

    Returns
    -------
    list of str, dict of str to str
        Identifiers to try; identifiers of unobservable effects with the reason, last those that
        need a column, or a bench.
    """
    surroundings = problem.model.surroundings
    own = {effect.id for effect in problem.model.effects}
    taken = {effect.id for effect in problem.model.effects if not may_differ(problem, effect)}
    names: list[str] = []
    unobservable: dict[str, str] = {}
    unrecorded: dict[str, str] = {}
    elsewhere: dict[str, str] = {}
    for name, effect in catalogue().items():
        if name in taken:
            continue
        if problem.catalogue is not None and name not in problem.catalogue:
            continue
        if problem.kind not in effect.kinds:
            if 'bench' in effect.kinds and effect.available(surroundings) and name not in own:
                elsewhere[name] = 'only a bench shows it, whose loads are held still'
            continue
        if not effect.available(surroundings):
            if problem.catalogue is not None:
                unobservable[name] = 'a muscle of this kind does not have it'
            continue
        if problem.catalogue is None and effect.doubtful(surroundings):
            continue
        column = effect.needs_column
        if effect.needs_transients and problem.settled:
            unobservable[name] = 'every row is settled'
        elif column and not (recorded_range(problem, column, effect.column_on_bench(surroundings))
                             > effect.smallest_change):
            unrecorded[name] = f'{column} was not recorded or did not change'
        else:
            names.append(name)
    return names, {**unobservable, **unrecorded, **elsewhere}


def recorded_range(problem: Problem, column: str, on_bench: float | None = None) -> float:
    """
    Return the range of a recorded column over all recordings; 0 where it was not recorded.

    With what the model was identified at, `on_bench`, where that is known.
    """
    values = np.concatenate([np.zeros(0), *(
        m.columns[column] for m in problem.measurements if column in m.columns)])
    values = values[np.isfinite(values)]
    if not len(values):
        return 0.0
    return float(np.ptp(values if on_bench is None else [*values, on_bench]))


def present(model: MuscleModel, kind: type[Effect], settled: bool) -> Effect:
    """Return the model's own effect of a kind, or a neutral one, for rows that are all settled."""
    own = [effect for effect in model.effects if effect.id == kind.id]
    effect = own[0] if own else kind(model.surroundings)
    return effect.in_settled_rows() if settled else effect


def may_differ(problem: Problem, effect: Effect) -> bool:
    """Whether an effect of the model may be another one here than on the bench that showed it."""
    return problem.kind == 'arm' and 'bench' in effect.kinds


def unaffected(fixed: Sequence[Effect], effects: Sequence[Effect]) -> list[Effect]:
    """
    Return the effects of a model that are not refitted with others.

    An effect of the wire that the bench has shown may be fitted anew to the wires of an arm.
    """
    fitted = {effect.id for effect in effects}
    return [effect for effect in fixed if effect.id not in fitted]
