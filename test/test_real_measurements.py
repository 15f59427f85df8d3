# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Real measurements of others, where the truth is not ours to choose."""

import os

import numpy as np
import pytest

from hysteresis_ros.comparison.compare import compare
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.measurements import Measurement, read_measurement

# File, trials to fit, trials held out, error after in percent of the range.
ALLOYS = {'nitihf': ([0, 1, 3, 5], [2, 4], 2.0), 'nitico': ([0, 1, 3], [2], 4.0)}
# What a load may do.
OF_A_LOAD = ('stress_dependence', 'stress_dependent_strain', 'r_phase', 'phase_modulus')


@pytest.fixture(scope='module')
def data(root):
    """Return the folder of the measurements, which lies beside the checkout."""
    folder = root.parent / 'shared' / 'data'
    if not folder.is_dir():
        if os.environ.get('CI') == 'true':
            pytest.fail(f'{folder} is missing, and in CI it has to be there')
        pytest.skip(f'{folder} is missing: real measurements are not part of the package')
    return folder


def percent(model, measurement, span):
    """Mean absolute error in percent of a range."""
    error = model.predict(measurement) - measurement.column(measurement.response)
    return 100.0 * np.mean(np.abs(error)) / span


@pytest.mark.slow
@pytest.mark.parametrize('alloy, names', [
    ('nitihf', OF_A_LOAD), pytest.param('nitihf', None, marks=pytest.mark.long),
    pytest.param('nitico', None, marks=pytest.mark.long)])
def test_the_load_that_a_plain_operator_does_not_know_is_found(data, alloy, names):
    """Stress shifts the transformation and makes it larger: two effects, on stresses not seen."""
    training, held_out, allowed = ALLOYS[alloy]
    table = read_measurement(data / 'sma_react' / f'{alloy}_isobaric.csv')
    assert (table.kind, table.drive, table.load, table.response) == (
        'bench', 'temperature', 'stress', 'strain')
    train, test = table.select(training), table.select(held_out)
    model = identify(train, operator='preisach').model
    span = np.ptp(table.column('strain'))
    assert percent(model, test, span) > 12.0

    found = diagnose(model, [train], names)
    assert found.verdict == 'missing'
    assert {'stress_dependence', 'stress_dependent_strain'} <= set(found.missing)
    extension = extend(model, found.missing, [train], [test])
    assert percent(extension.model, test, span) <= allowed
    values = {effect.id: effect.values for effect in extension.added}
    assert 5.0 <= values['stress_dependence']['C'] <= 15.0
    assert extension.test['rmse_after'] < 0.25 * extension.test['rmse_before']


@pytest.mark.slow
@pytest.mark.long
def test_an_alloy_expands_with_its_temperature(data):
    """NiTiHf: between the stresses that are fitted half of the error was the expansion."""
    training, held_out, _ = ALLOYS['nitihf']
    table = read_measurement(data / 'sma_react' / 'nitihf_isobaric.csv')
    train, test = table.select(training), table.select(held_out)
    model, added = add_effects(identify(train, operator='preisach').model, train)
    values = {effect.id: effect for effect in added}
    assert set(values) == {'stress_dependence', 'stress_dependent_strain', 'phase_modulus',
                           'thermal_expansion'}
    # Of Ni-Ti alloys from 6.6 to 14 millionths per kelvin are known.
    low, high = values['thermal_expansion'].intervals['alpha']
    assert 5.0 < low < high < 20.0
    assert percent(model, test, np.ptp(test.column('strain'))) < 1.0


def test_a_piezo_stack_is_described_by_one_operator(data):
    """Nested minor loops, sampled in time: better than any straight line."""
    table = read_measurement(data / 'piezo' / 'stack_nested_loops.csv')
    rows = int(0.7 * table.rows)
    first = Measurement.from_columns(
        {name: values[:rows] for name, values in table.columns.items()}, source=table.source)
    model = identify(first, operator='preisach').model
    report = compare(model, [first]).to_dict()
    assert report['quantity'] == 'length' and report['rows'] == rows
    assert report['model']['mean_percent'] < 1.5
    assert report['linear']['mean_percent'] > 2.0 * report['model']['mean_percent']
