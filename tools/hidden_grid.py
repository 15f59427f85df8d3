# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
The cases of the hidden-effect grid, and what is scored of each.

A module of its own, so that workers can import what they are given.
"""

import itertools
import time
from typing import NamedTuple

from hidden_scores import FIRST_MUSCLE, Row
import numpy as np

# Seeds from this one on were never looked at while thresholds were chosen.
FIRST_SEED = 53000
STRENGTHS = {'strong': 1.0, 'weak': 0.4}
# Effects that only transients can show are hidden in continuous recordings, others in settled ones.
TRANSIENT = {'thermal_lag', 'heating_cooling_asymmetry', 'latent_heat', 'heat_loss', 'creep',
             'viscous_friction', 'inertia', 'latency', 'ambient_drift', 'fatigue'}
# Most probable sets of each case that are written.
SETS_WRITTEN = 5


class Case(NamedTuple):
    """
    What is hidden in one case.

    Parameters
    ----------
    muscle : str
        Constitutive model of the wires.
    group : str
        strong, weak, none, unknown or pair.
    protocol : str
        Experiment of the laboratory.
    effects : dict of str to float
        Strengths of the hidden effects.
    seed : int
        Of specimen and recordings.
    """

    muscle: str
    group: str
    protocol: str
    effects: dict[str, float]
    seed: int


def cases(seeds: int, others: int, quick: bool = False,
          muscles: tuple[str, ...] = (FIRST_MUSCLE,)) -> list[Case]:
    """Return every case of the muscles, without effects that a muscle cannot have."""
    refused = {muscle: refused_effects(muscle) for muscle in muscles}
    return [Case(muscle, *case) for muscle in muscles for case in grid(seeds, others, quick)
            if not refused[muscle].intersection(case[2])]


def grid(seeds: int, others: int, quick: bool) -> list[tuple]:
    """Return (group, protocol, effects by strength, seed) of every case of one laboratory."""
    from hysteresis_ros.laboratory.hidden_physics import hidden_effects, unlisted_effects

    def protocol(names):
        return 'arm-dynamic' if any(name in TRANSIENT for name in names) else 'arm-steps'

    listed = list(hidden_effects())
    found = []
    for name, (group, strength) in itertools.product(listed, STRENGTHS.items()):
        for seed in range(seeds):
            found.append((group, protocol([name]), {name: strength}, FIRST_SEED + seed))
    rng = np.random.default_rng(5)
    for number in range(others):
        seed = FIRST_SEED + 100 + number
        kind = 'arm-dynamic' if number % 4 == 3 else 'arm-steps'
        found.append(('none', kind, {}, seed))
        unlisted = unlisted_effects()
        name = unlisted[number % len(unlisted)]
        found.append(('unknown', 'arm-dynamic' if number % 2 else 'arm-steps', {name: 1.0}, seed))
        pair = sorted(rng.choice(listed, 2, replace=False).tolist())
        found.append(('pair', protocol(pair), {name: 1.0 for name in pair}, seed))
    return found[::9] if quick else found


def refused_effects(muscle: str) -> set[str]:
    """Return the effects that the constitutive equations of a muscle cannot have."""
    from hysteresis_ros.errors import ParameterError
    from hysteresis_ros.laboratory.conditions import Conditions
    from hysteresis_ros.laboratory.hidden_physics import apply_effects, EFFECTS
    from hysteresis_ros.laboratory.plant import specimen

    refused = set()
    for name in EFFECTS:
        try:
            apply_effects(Conditions(material=specimen(0, muscle)), {name: 1.0}, 0)
        except ParameterError:
            refused.add(name)
    return refused


def base_model(muscle: str, seed: int, material: bool):
    """Identify the bench of the specimen, on which nothing is hidden."""
    from hysteresis_ros.bicep import BicepGeometry
    from hysteresis_ros.identification.bench import identify
    from hysteresis_ros.diagnosis.bench_effects import add_effects
    from hysteresis_ros.laboratory.experiments import experiment_tables
    from hysteresis_ros.laboratory.linkage import GEOMETRY
    from hysteresis_ros.measurements.table import Measurement

    tables = experiment_tables('bench', {}, seed, muscle)
    force, length = (Measurement.from_columns(tables[name]) for name in
                     ('force.csv', 'length.csv'))
    trials = {'length_trials': range(4), 'force_trials': [0]}
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **trials).model
    if material:
        model, _ = add_effects(model, length, force, **trials)
    return model


def run(case: Case, model, settings=None) -> Row:
    """
    Diagnose one case with the model of its specimen and return what is scored.

    Parameters
    ----------
    case : Case
    model : MuscleModel
    settings : Settings, optional
        Of the diagnosis.
    """
    from hysteresis_ros.diagnosis.diagnose import diagnose
    from hysteresis_ros.diagnosis.extend import extend, rmse
    from hysteresis_ros.diagnosis.settings import Settings
    from hysteresis_ros.effects import catalogue
    from hysteresis_ros.laboratory.experiments import experiment_tables
    from hysteresis_ros.measurements.table import Measurement

    muscle, group, protocol, effects, seed = case
    started = time.perf_counter()
    tables = experiment_tables(protocol, effects, seed, muscle)
    train, test = (Measurement.from_columns(tables[name]) for name in ('train.csv', 'test.csv'))
    # What is tried only where it is named, its user has named.
    named = [name for name in effects
             if name in catalogue() and catalogue()[name].doubtful(model.surroundings)]
    found = diagnose(model, [train], list(catalogue()) if named else None, seed=seed,
                     settings=settings or Settings())
    reported = set(found.missing).union(*found.alternatives) if found.missing else set()
    result = {'muscle': muscle, 'group': group, 'protocol': protocol, 'truth': sorted(effects),
              'seed': seed, 'verdict': found.verdict, 'missing': found.missing,
              'alternatives': found.alternatives, 'reported': sorted(reported),
              'sets': found.sets[:SETS_WRITTEN],
              'rmse_before': found.rmse_before, 'rmse_after': found.rmse_after,
              'structure': found.structural_error, 'unexplained': found.unexplained,
              'seconds': time.perf_counter() - started,
              'top': [(row['effect'], round(row['rmse_after'], 5), round(row['p_value'], 3))
                      for row in found.ranking[:4]]}
    if group == 'pair' and found.missing and not set(effects) <= reported:
        result['unseen'], result['unseen_of_truth'] = (
            rmse(extend(model, names, [train]).model, [test])
            for names in (found.missing, list(effects)))
    if group in ('strong', 'weak') and found.missing:
        tables = experiment_tables(protocol, {}, seed, muscle)
        clean = Measurement.from_columns(tables['test.csv'])
        extended = extend(model, found.missing, [train]).model
        result['unseen'] = rmse(extended, [test])
        result['clean'] = rmse(model, [clean])
    return result
