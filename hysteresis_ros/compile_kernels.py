# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Compile the kernels once after an installation: `python -m hysteresis_ros.compile_kernels`.

What the commands and nodes do is done on small data, so that none of them has to wait for the
compiler the first time that a user calls it. The machine code stays in the kernels' cache.
"""

import contextlib
import itertools
import logging
import time

import numpy as np

from hysteresis_ros import api
from hysteresis_ros.effects import catalogue, Effect, Parameter
from hysteresis_ros.errors import HysteresisError
from hysteresis_ros.kernels.warm_up import small_model, warm_up
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import MuscleModel
from hysteresis_ros.model.simulation import Simulator

DRIVE = np.array([0.0, 2.0, 5.0, 3.0, 4.0, 0.0])    # V
# Cells of the second stage that are enough for every step of an identification.
LEVELS = 4, 6
BENCH_EFFECTS = ('stress_dependence', 'stress_dependent_strain', 'transformation_slopes',
                 'phase_modulus', 'kinetics')


def compile_kernels() -> float:
    """
    Control, observe, simulate and identify with a small model; return how long it took.

    Returns
    -------
    float
        Time taken [s].
    """
    start = time.perf_counter()
    model = small_model()
    warm_up(model)
    for effect in effects_at_work(model):
        # One that this model cannot have says so.
        with contextlib.suppress(HysteresisError):
            extended = model.with_effects([effect])
            for dt in (0.1, 30.0):
                run = arm_run(dt)
                extended.predict(run)
                Simulator(model, run, judged=np.arange(2)).run([effect])
            warm_up(extended)
    identify_on_the_bench()
    return time.perf_counter() - start


def effects_at_work(model: MuscleModel) -> list[Effect]:
    """Return every effect of the catalogue, in each of its forms, with values that let it act."""
    found = []
    for kind in catalogue().values():
        parameters = kind.describe(model.surroundings)
        for values in itertools.product(*map(_values, parameters)):
            named = {parameter.name: value for parameter, value in zip(parameters, values)}
            found.append(kind(model.surroundings, **named))
    return found


def _values(parameter: Parameter) -> list[float]:
    """Return the values of a parameter that may need kernels of their own."""
    if parameter.choices:
        return list(parameter.choices)
    first = [*parameter.starts, parameter.neutral][:1]
    return [parameter.neutral, *first] if parameter.form else first


def arm_run(dt: float) -> Measurement:
    """Return a run of an arm with a row every `dt` seconds."""
    return Measurement.from_columns({
        'time': dt * np.arange(1, len(DRIVE) + 1), 'trial': np.zeros(len(DRIVE)),
        'voltage': DRIVE, 'angle': np.full(len(DRIVE), 1.5)})


def identify_on_the_bench() -> None:
    """Identify each kind of operator, and effects, on thinned tables of a bench."""
    tables = experiment_tables('bench')
    length, force = (
        {name: values[np.isin(table['trial'], trials)][::6] for name, values in table.items()}
        for table, trials in ((tables['length.csv'], [0, 1, 2]), (tables['force.csv'], [0])))
    for operator in ('preisach', 'play', 'bouc-wen', 'linear'):
        with contextlib.suppress(HysteresisError):
            api.identify(length, operator=operator, levels=LEVELS)
    # All that a search among sets calls; in this process alone, so that no two compile the same.
    api.identify(length, force, levels=LEVELS, effects=BENCH_EFFECTS, jobs=1)


if __name__ == '__main__':
    logging.basicConfig(format='%(message)s', level=logging.INFO)
    logging.info('kernels ready in %.1f s', compile_kernels())
