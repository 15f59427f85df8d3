# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The paper's whole experiment in the virtual laboratory: identify, verify, compensate (Table I).

A specimen is identified on its bench (damped oscillation at resting length and under four loads)
and verified on random steps. Then references are inverted and applied: 74 random forces, 30 random
lengths under each load, and 40 target angles of the arm twice, a sinusoid and random ones. The
controller sees nothing of what it does: all of it is feedforward, as in the paper.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.measurements.metrics import errors
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.identification.baselines import (
    fit_additive, fit_embedded_line, fit_one_load, simulate)
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import bench_of, Plant, SOFT_MUSCLES
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.workers import one_blas_thread

if TYPE_CHECKING:
    from hysteresis_ros.model import Controller, MuscleModel

ROWS = ('F-q identification', 'F-q verification', 'F-q compensation', 'L-q identification',
        'L-q verification', 'L-q compensation', 'arm, sinusoidal', 'arm, random')
# Table I: mean error and standard deviation, in percent and for the arm in degrees.
PAPER = {
    'two-stage': ((0.8, 0.8), (0.9, 0.7), (1.3, 0.8), (2.9, 3.4), (3.4, 5.2), (4.9, 5.5),
                  (1.8, 0.8), (1.6, 1.1)),
    'linear': ((2.2, 1.7), (2.7, 1.7), (2.1, 1.5), (14.1, 9.9), (12.6, 9.9), (11.5, 9.5),
               (3.4, 1.7), (4.2, 2.9)),
}
FORCE_TRIALS, LENGTH_TRIALS = (0,), (0, 1, 2, 3)
FORCE_STEPS, LENGTH_STEPS, ARM_STEPS = 74, 30, 40
# References stay inside what the bench and the arm have shown by this share of it at both ends.
MARGIN = 0.02
# The trial under the load of Fig. 9, the second.
ONE_LOAD = 1


@one_blas_thread()
def table1(seeds: Iterable[int], effects: Sequence[str] | None = (), jobs: int = 1,
           muscle: str = 'grains') -> dict:
    """
    Carry the experiment out on several specimens.

    Parameters
    ----------
    seeds : iterable of int
        Specimens.
    effects : sequence of str or None
        Effects that are added to the two-stage model, which then has columns of its own; None
        adds those that the bench tables prove.
    jobs : int
        Processes for the search of effects.
    muscle : str
        What is on the bench, a key of `MUSCLES` or `SOFT_MUSCLES` of the laboratory.

    Returns
    -------
    dict
        ``rows``: for each of `ROWS` its unit, and for each method (two-stage, linear, and
        two-stage with effects) the mean over the seeds of mean error and standard deviation
        (Eqs. 23 and 24), beside the paper's; ``seeds``: the same for each specimen;
        ``baselines``: mean errors of the models of Sec. III-B and Fig. 9; ``muscle``. A muscle
        that is no wire has neither the arm's rows nor numbers of the paper.
    """
    single = [experiment(seed, effects, jobs, muscle) for seed in seeds]
    if not single:
        raise ParameterError('table1: no specimen; give at least one seed')
    rows = []
    papers = {} if muscle in SOFT_MUSCLES else PAPER
    for k, name in enumerate(rows_of(muscle)):
        ours = {method: {key: float(np.mean([one['rows'][k][method][key] for one in single]))
                         for key in ('mean', 'std')} for method in single[0]['rows'][k]}
        paper = {method: dict(zip(('mean', 'std'), papers[method][k])) for method in papers}
        rows.append({'name': name, 'unit': unit(name), 'paper': paper, 'ours': ours})
    baselines = {name: {part: float(np.mean([one['baselines'][name][part] for one in single]))
                        for part in values} for name, values in single[0]['baselines'].items()}
    return {'rows': rows, 'baselines': baselines, 'seeds': single, 'muscle': muscle}


def rows_of(muscle: str) -> tuple[str, ...]:
    """Return the rows of Table I that there are for a muscle: only wires drive an arm."""
    if muscle in SOFT_MUSCLES:
        return tuple(row for row in ROWS if not row.startswith('arm'))
    return ROWS


def unit(row: str) -> str:
    """Return the unit of a row of Table I."""
    return 'deg' if row.startswith('arm') else '%'


def experiment(seed: int, effects: Sequence[str] | None = (), jobs: int = 1,
               muscle: str = 'grains') -> dict:
    """
    Carry the experiment out on one specimen.

    Returns
    -------
    dict
        ``rows``: for each row of the muscle and each method ``{'mean', 'std'}``; ``effects``: what
        was added; ``baselines``; ``seed``.
    """
    tables = bench_tables({}, seed, muscle)
    force = Measurement.from_columns(tables['force.csv'])
    length = Measurement.from_columns(tables['length.csv'])
    geometry = None
    if muscle not in SOFT_MUSCLES:
        geometry = BicepGeometry.from_mapping(GEOMETRY, 'laboratory')
    model = identify(length, force, force_trials=FORCE_TRIALS, length_trials=LENGTH_TRIALS,
                     geometry=geometry).model
    methods = {'two-stage': (model, 'preisach'), 'linear': (model, 'linear')}
    added: list = []
    if effects is None or len(effects):
        extended, added = add_effects(model, length, force, effects, LENGTH_TRIALS, FORCE_TRIALS,
                                      jobs=jobs)
        methods['with effects'] = (extended, 'preisach')
    rows: list[dict[str, dict[str, float]]] = [{} for _ in rows_of(muscle)]
    for method, (with_model, kind) in methods.items():
        plant = bench_of(seed, recording=1, muscle=muscle)
        for k, (residual, span) in enumerate(residuals(
                plant, with_model, kind, force, length, np.random.default_rng([seed, 31]))):
            found = errors(residual, span)
            rows[k][method] = {'mean': found.mean_percent, 'std': found.std_percent}
    return {'seed': int(seed), 'rows': rows, 'effects': [effect.id for effect in added],
            'baselines': baselines(force, length)}


def residuals(plant: Plant | SoftBench, model: MuscleModel, method: str,
              force: Measurement, length: Measurement,
              rng: np.random.Generator) -> Iterator[tuple[np.ndarray, float]]:
    """
    Yield residual and output range for each row of Table I.

    For the arm the residual is in degrees and the range 100, so that percent are degrees.
    """
    inverse = Inverse(model, method)
    for table, fitted in ((force, FORCE_TRIALS), (length, LENGTH_TRIALS)):
        measured = table.column(table.response)
        span = float(np.ptp(measured))
        residual = measured - model.predict(table, method)
        chosen = np.isin(table.column('trial'), fitted)
        yield residual[chosen], span
        yield residual[~chosen], span
        if table is force:
            wanted = inside(measured[chosen], FORCE_STEPS, rng)
            yield plant.force_trial(inverse.forces(wanted)) - wanted, span
        else:
            parts = []
            for trial, load in zip(LENGTH_TRIALS, plant.material.loads):
                wanted = inside(measured[table.column('trial') == trial], LENGTH_STEPS, rng)
                parts.append(plant.length_trial(inverse.lengths(wanted, load), load) - wanted)
            yield np.concatenate(parts), span
    if isinstance(plant, SoftBench):
        return
    # Where the arm can be: no voltage, and the highest.
    ends = plant.arm_trial([0.0, inverse.limits[1]])['angle']
    turn = np.arange(1, ARM_STEPS + 1) / ARM_STEPS
    sinusoid = 0.5 * (1.0 + np.cos(4.0 * np.pi * turn))
    low, high = ends.min() + MARGIN * np.ptp(ends), ends.max() - MARGIN * np.ptp(ends)
    for wanted in (low + (high - low) * sinusoid, inside(ends, ARM_STEPS, rng)):
        angle = plant.arm_trial(inverse.angles(wanted))['angle']
        yield np.degrees(angle - wanted), 100.0


def inside(values: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return random references within the range of values, `MARGIN` from its ends."""
    margin = MARGIN * float(np.ptp(values))
    return rng.uniform(values.min() + margin, values.max() - margin, count)


class Inverse:
    """
    Drives for sequences of references, from the cold state (Eqs. 12 to 15).

    Parameters
    ----------
    model : MuscleModel
        Identified model.
    method : {'preisach', 'linear'}
        Two-stage inverse, or that of the linear model.
    """

    def __init__(self, model: MuscleModel, method: str) -> None:
        self.limits = model.ranges[model.drive]
        self._model = model
        self._line = model.linear if method == 'linear' else None

    def _controller(self, arm: bool = False) -> Controller:
        return self._model.controller(voltage_limits=self.limits, arm=arm)

    def forces(self, wanted: np.ndarray) -> np.ndarray:
        """Return the drives for forces at resting length, shape (n,)."""
        if self._line is not None:
            return np.clip(self._line.drive_for_force(wanted), *self.limits)
        controller = self._controller()
        return np.array([controller.force_setpoint(force).voltage for force in wanted])

    def lengths(self, wanted: np.ndarray, load: float) -> np.ndarray:
        """Return the drives for lengths under one load, shape (n,)."""
        if self._line is not None:
            return np.clip(self._line.drive_for_length(wanted, load), *self.limits)
        controller = self._controller()
        return np.array([controller.setpoint(length, load).voltage for length in wanted])

    def angles(self, wanted: np.ndarray) -> np.ndarray:
        """Return the drives for angles of the arm [rad], shape (n,)."""
        geometry = self._model.require_geometry()
        if self._line is not None:
            return np.clip(self._line.drive_for_length(
                geometry.length(wanted), geometry.force(wanted)), *self.limits)
        controller = self._controller(arm=True)
        references = (controller.reference(theta) for theta in wanted.tolist())
        return np.array([controller.setpoint(*reference).voltage for reference in references])


def baselines(force: Measurement, length: Measurement) -> dict:
    """
    Return how far the models are off that the paper compares with.

    Returns
    -------
    dict
        For the additive model and the embedded line mean ``|e| / P`` in percent, identification and
        verification; for Fig. 9 mean ``|e|`` in mm at its load, one operator and two stages.
    """
    fitted = length.select(LENGTH_TRIALS)
    others = length.select(sorted(set(length.trials) - set(LENGTH_TRIALS)))
    forces = force.select(FORCE_TRIALS)
    span = float(np.ptp(length.column('length')))

    def mean_error(predicted: np.ndarray, table: Measurement) -> float:
        return float(np.mean(np.abs(predicted - table.column('length'))))
    result = {}
    for name, (model, _) in (('additive', fit_additive(fitted)),
                             ('embedded line', fit_embedded_line(fitted, forces))):
        result[name] = {part: 100.0 * mean_error(simulate(model, table), table) / span
                        for part, table in (('identification', fitted), ('verification', others))}
    one = length.select([ONE_LOAD])
    two = identify(fitted, forces).model
    result['Fig. 9 (mm)'] = {
        'two-stage': 1e3 * mean_error(two.predict(one), one),
        'one operator': 1e3 * mean_error(simulate(fit_one_load(one)[0], one), one)}
    return result
