# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whether loads held out on a bench show minor loops that do not close (`effects.kinetics`).

The weights of H2 follow the minor loops of the loads that they are fitted to, whatever these are.
They cannot do so for a load that they have not seen, and what is predicted there tells the kinetics
of the wire. They are sought once the other effects are known, because each wire has kinetics and no
other effect stands for them.
"""

from __future__ import annotations

from collections.abc import Sequence
import dataclasses

import numpy as np

from hysteresis_ros.diagnosis.arm_fit import Fit
from hysteresis_ros.diagnosis.bench_fit import BenchFitter
from hysteresis_ros.diagnosis.bench_problem import BenchProblem
from hysteresis_ros.diagnosis.determined import not_determined
from hysteresis_ros.diagnosis.significance import typical_gain_interval
from hysteresis_ros.effects import Effect
from hysteresis_ros.effects.kinetics import Kinetics
from hysteresis_ros.measurements.turns import turns


@dataclasses.dataclass
class BenchKinetics:
    """
    What the loads of a bench show with kinetics.

    Attributes
    ----------
    effects : list of Effect
        Those found before and, last, `Kinetics`, fitted together, with intervals.
    before, after : Fit
        Cross-validated.
    """

    effects: list[Effect]
    before: Fit
    after: Fit


def shown_kinetics(fitter: BenchFitter, found: Sequence[Effect], practical: float,
                   rng: np.random.Generator) -> BenchKinetics | None:
    """
    Return the effects found on a bench with the kinetics of the wire.

    Parameters
    ----------
    fitter : BenchFitter
        Rows, and a model without the effects.
    found : sequence of Effect
        Effects with values.
    practical : float
        Share by which the typical RMSE of loads held out has to fall for sure.
    rng : numpy.random.Generator

    Returns
    -------
    BenchKinetics or None
        None where there are no minor loops, the rows do not determine the share, or loads held
        out are not sure to be predicted better by what matters.
    """
    problem = fitter.problem
    surroundings = problem.model.surroundings
    known = {effect.id for effect in (*fitter.fixed, *found)}
    if (Kinetics.id in known or not Kinetics.available(surroundings)
            or not _has_minor_loops(problem)):
        return None
    with np.errstate(all='ignore'):
        own = fitter
        after = own.search(found, Kinetics(surroundings))
        effects = _with_intervals(own, after)
        # What loads held out have determined is not refitted to rows that do not determine it.
        fixed = [one for one, fitted in zip(found, effects) if not_determined(fitted, problem.kind)]
        if fixed:
            own = fitter.apart()
            own.fixed = [*fitter.fixed, *fixed]
            after = own.search([one for one in found if one not in fixed], Kinetics(surroundings))
            effects = _with_intervals(own, after)
        if not effects or after.implausible() or any(
                not_determined(effect, problem.kind) for effect in effects):
            return None
        before, after = fitter.cross_validate(fitter.fit(found)), own.cross_validate(after)
    # What is little on a bench, which goes through each minor loop once, may be much on an arm.
    gain, _ = typical_gain_interval(
        problem.measured - before.held_out, problem.measured - after.held_out, problem.block,
        problem.fold, problem.noise, rng)
    # A comparison that NaN does not pass.
    return BenchKinetics([*fixed, *effects], before, after) if gain >= practical else None


def _has_minor_loops(problem: BenchProblem) -> bool:
    """
    Whether the drive of some trial turns again after it has turned once.

    Branches of the major loop are those of H2 whatever the kinetics. A swing within an interval of
    the grid of H2 is noise.
    """
    # A drive that stands still is no signal.
    drive = problem.signals.get('drive', np.zeros(len(problem.measured)))
    least = float(np.ptp(drive)) / problem.levels
    return any(turns(drive[problem.trial == trial], least) > 1
               for trial in np.unique(problem.trial))


def _with_intervals(fitter: BenchFitter, fit: Fit) -> list[Effect]:
    """Return the effects of a fit with intervals; none where it is not finite."""
    return fitter.with_intervals(fit) if np.all(np.isfinite(fit.predicted)) else []
