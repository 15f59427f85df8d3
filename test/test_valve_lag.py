# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A valve that fills and vents a muscle: where it is tried, its inverse, and the laboratory's."""

import math

import numpy as np
import pytest

from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.effects import catalogue, Inputs, Surroundings
from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import experiment_tables
from hysteresis_ros.laboratory.hidden_soft import with_effects
from hysteresis_ros.laboratory.mckibben import McKibbenMaterial
from hysteresis_ros.laboratory.soft_bench import SoftBench
from hysteresis_ros.measurements import Measurement
from model_support import bladder

BLADDER = Surroundings(0.3, 100.0, 3e5, 0.06, drive='pressure')
LAGS_OF_HEAT = {'thermal_lag', 'heating_cooling_asymmetry', 'latent_heat'}


def valve(filling, venting):
    """Return the effect with its times [s]."""
    return catalogue()['valve_lag'](BLADDER, filling=filling, venting=venting)


def recording(model, dt=0.2, seed=3):
    """Return what the model does under two loads and steps of all lengths."""
    rng = np.random.default_rng(seed)
    columns = {name: [] for name in ('time', 'trial', 'pressure', 'force')}
    for trial, load in enumerate((60.0, 120.0)):
        steps = np.repeat(rng.uniform(0.0, 3e5, 12), rng.integers(3, 25, 12))
        columns['time'].append(dt * np.arange(1, len(steps) + 1))
        columns['trial'].append(np.full(len(steps), float(trial)))
        columns['pressure'].append(steps)
        columns['force'].append(np.full(len(steps), load))
    columns = {name: np.concatenate(values) for name, values in columns.items()}
    run = Measurement.from_columns({**columns, 'length': np.zeros(len(columns['time']))})
    return Measurement.from_columns({**columns, 'length': model.predict(run)})


def test_pressure_fills_and_vents_in_times_of_their_own():
    made = valve(0.5, 2.0)
    up = made.step(1e5, 0.5, math.nan, BLADDER)
    assert up == pytest.approx(1e5 * (1.0 - math.exp(-1.0)))
    assert made.step(0.0, 2.0, math.nan, BLADDER) == pytest.approx(up * math.exp(-1.0))
    quick = valve(0.0, 2.0)
    assert quick.step(1e5, 1e-3, math.nan, BLADDER) == 1e5


@pytest.mark.parametrize('before, target', [(2e5, 1e5), (1e5, 2e5), (0.0, 1e5)])
def test_the_inverse_brings_the_pressure_there_in_time(before, target):
    made = valve(0.5, 2.0)
    made.step(before, 1e3, math.nan, BLADDER)
    inputs = Inputs(0.0, 0.0, 0.3, math.nan, math.nan, 0.0)
    wanted = made.inverse(target, inputs, BLADDER)
    assert abs(wanted - before) > abs(target - before)
    assert made.step(wanted, 0.3, math.nan, BLADDER) == pytest.approx(target)


def test_the_past_can_be_saved_and_forgotten():
    made, other = valve(0.5, 2.0), valve(0.5, 2.0)
    made.step(2e5, 0.3, math.nan, BLADDER)
    other.restore(made.save())
    assert other.step(0.0, 0.3, math.nan, BLADDER) == made.step(0.0, 0.3, math.nan, BLADDER) > 0.0
    made.start()
    assert made.step(0.0, 0.3, math.nan, BLADDER) == 0.0


def test_its_extremes_are_those_of_both_intervals():
    made = valve(0.5, 2.0)
    made.intervals = {'venting': (1.0, 2.1)}
    fast, slow = made.extremes(0.1)
    assert fast.values == pytest.approx({'filling': 0.45, 'venting': 1.0})
    assert slow.values == pytest.approx({'filling': 0.55, 'venting': 2.2})
    assert valve(0.0, 0.0).extremes(0.1) == []


def test_it_takes_the_place_of_the_lags_of_heat_where_pressure_drives():
    for drive, expected in (('pressure', {'valve_lag'}), ('voltage', LAGS_OF_HEAT),
                            ('temperature', LAGS_OF_HEAT)):
        muscle = BLADDER._replace(drive=drive)
        assert {name for name in (*LAGS_OF_HEAT, 'valve_lag')
                if catalogue()[name].available(muscle)} == expected


def test_it_is_tried_only_on_recordings_in_motion():
    model = bladder()
    names, unobservable = observable(problem_for(model, [recording(model)]))
    assert 'valve_lag' in names and not LAGS_OF_HEAT.intersection({*names, *unobservable})
    names, unobservable = observable(problem_for(model, [recording(model, dt=30.0)]))
    assert 'valve_lag' not in names and unobservable['valve_lag'] == 'every row is settled'


@pytest.mark.slow
def test_it_is_named_with_both_times():
    made = catalogue()['valve_lag'](bladder().surroundings, filling=0.6, venting=1.8)
    tried = ['valve_lag', 'creep', 'fatigue']
    found = diagnose(bladder(), [recording(bladder([made]))], tried)
    assert (found.verdict, found.missing) == ('missing', ['valve_lag'])
    assert found.effects[0].filling == pytest.approx(0.6, rel=0.15)
    assert found.effects[0].venting == pytest.approx(1.8, rel=0.15)
    assert 'valve_lag' not in diagnose(bladder(), [recording(bladder())], tried).missing


def test_the_laboratorys_narrow_valve_is_slow_both_ways():
    plain = McKibbenMaterial()
    narrow, _ = with_effects(plain, {'valve_lag': 1.0}, 0)
    assert narrow.venting_time > narrow.filling_time > 2.0 * plain.filling_time
    drives = np.repeat([3e5, 0.0], 20)
    quick, slow = (SoftBench(one).length_run(0.2, drives, 100.0) for one in (plain, narrow))
    for first in (0, 20):
        gone = [(run[first + 3] - run[first - 1 if first else 0]) / (run[first + 19] - run[first])
                for run in (quick, slow)]
        assert gone[1] < 0.9 * gone[0]
    assert quick[19] == pytest.approx(slow[19], abs=3e-3)


def test_continuous_bench_recordings_are_of_muscles_that_are_no_wires():
    table = experiment_tables('bench-dynamic', {'valve_lag': 1.0}, 2, 'mckibben')['length.csv']
    run = Measurement.from_columns(table)
    assert (run.kind, run.drive, run.settled, len(run.trials)) == ('bench', 'pressure', False, 3)
    with pytest.raises(ParameterError, match='bench-dynamic is for mckibben and scp'):
        experiment_tables('bench-dynamic', {}, 2, 'grains')
    with pytest.raises(ParameterError, match='scp muscle cannot have valve_lag'):
        experiment_tables('bench', {'valve_lag': 1.0}, 2, 'scp')
    with pytest.raises(ParameterError, match='from 0 to 2'):
        experiment_tables('bench', {'valve_lag': 3.0}, 2, 'mckibben')
