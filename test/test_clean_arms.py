# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Arms on which nothing is hidden, with wires of other constitutive equations."""

import pytest

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.measurements import Measurement

TRIALS = {'length_trials': range(4), 'force_trials': [0]}


@pytest.mark.long
@pytest.mark.parametrize('muscle, seed', [
    ('lagoudas', 6301), ('lagoudas', 6302), ('tanaka', 6301), ('tanaka', 6302)])
def test_a_clean_arm_is_adequate_whatever_its_wires_are(muscle, seed):
    """
    With what its bench proves; on a whole recording of four settled trials.

    All of 4: if one in three had a name, that would happen in less than 20 % of all cases, so that
    only a coarse failure shows here.
    """
    tables = experiment_tables('bench', {}, seed, muscle)
    force, length = (Measurement.from_columns(tables[name]) for name in ('force.csv', 'length.csv'))
    base = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **TRIALS).model
    model, _ = add_effects(base, length, force, **TRIALS)
    run = Measurement.from_columns(experiment_tables('arm-steps', {}, seed, muscle)['train.csv'])
    found = diagnose(model, [run], seed=seed)
    assert (found.verdict, found.missing) == ('adequate', [])
