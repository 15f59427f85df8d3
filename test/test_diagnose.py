# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects hidden in the virtual laboratory's arm: found, named, and added, or called unknown."""

import dataclasses
import json
import math

from hidden_cases import clean_bench, TRIALS, UNIVERSAL
from model_support import autoregressive, effect_of, with_noise
import numpy as np
import pytest

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.cli.diagnose import to_text
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import Diagnosis, diagnose
from hysteresis_ros.diagnosis.extend import extend, rmse
from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import MeasurementError, ParameterError
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.conditions import Air, ROOM
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.laboratory.plant import Plant
from hysteresis_ros.measurements import Measurement

SEED = 11
RANKED = {'effect', 'rmse_before', 'rmse_after', 'gain', 'gain_low', 'gain_high', 'p_value',
          'parameters', 'plausible', 'absorbed', 'confused_with'}
# What a lag in continuous recordings could be mistaken for.
RIVALS = ('thermal_lag', 'airflow', 'encoder_offset', 'latency')
# What explains most of a shaken bench, though little.
NEAR_SHAKEN = ('pwm_dead_zone', 'supply_limit', 'heat_loss', 'backlash')


@pytest.fixture(scope='module')
def model():
    """Return the model of a bench on which nothing is hidden."""
    return model_of(SEED)


def model_of(seed):
    """Return the model of a specimen's bench."""
    tables = experiment_tables('bench', {}, seed)
    force, length = (Measurement.from_columns(tables[name], source=name)
                     for name in ('force.csv', 'length.csv'))
    trials = {'length_trials': range(4), 'force_trials': [0]}
    base = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY), **trials).model
    found, added = add_effects(base, length, force,
                               ['stress_dependence', 'stress_dependent_strain',
                                'series_compliance'], **trials)
    assert len(added) == 3
    return found


def recordings(effects, protocol='arm-steps', trials=(0, 1), every=1, seed=SEED):
    """Return some trials of the recording to diagnose, and the whole one that nothing has seen."""
    tables = experiment_tables(protocol, effects, seed)
    train, test = (Measurement.from_columns(
        {column: values[::every] for column, values in tables[name].items()}, source=name)
        for name in ('train.csv', 'test.csv'))
    return train.select(trials), test


def reported(found):
    """Return the set of effects that a person has to think of."""
    return set(found.missing).union(*found.alternatives)


def check_json(found):
    """The names and types that programs rely on."""
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert content['verdict'] in ('adequate', 'missing', 'unknown', 'not_excited')
    assert set(content['missing']) <= set(catalogue())
    assert len(content['alternatives']) == len(content['missing'])
    for row in content['ranking']:
        assert set(row) == RANKED
        assert row['gain_low'] <= row['gain_high'] and 0.0 < row['p_value'] <= 1.0
        assert 0.0 <= row['absorbed'] <= 1.0 and isinstance(row['plausible'], bool)
        assert row['gain'] == pytest.approx(1.0 - row['rmse_after'] / row['rmse_before'])
        assert row['effect'] not in row['confused_with']
        for entry in row['parameters'].values():
            assert set(entry) >= {'value', 'low', 'high', 'unit'}
            assert entry['low'] <= entry['high']
    assert sum(one['probability'] for one in content['sets']) == pytest.approx(1.0)
    for one in content['sets']:
        assert set(one) == {'effects', 'probability', 'rmse'} and 0.0 <= one['probability'] <= 1.0
        assert one['effects'] == ['unknown'] or set(one['effects']) <= set(catalogue())
    assert [one['probability'] for one in content['sets']] == sorted(
        (one['probability'] for one in content['sets']), reverse=True)
    assert content['noise_floor'] >= 0.0 and 0.0 <= content['unexplained'] <= 1.0
    assert isinstance(content['experiment'], str) and content['experiment']


def test_nothing_is_named_where_nothing_is_hidden(model):
    """A model that is as good as its bench said is adequate."""
    train, _ = recordings({})
    found = diagnose(model, [train], seed=SEED)
    assert (found.verdict, found.missing, found.alternatives) == ('adequate', [], [])
    assert found.effects == [] and found.rmse_after == found.rmse_before
    assert 'thermal_lag' in found.not_excited        # every row is settled
    assert 'Adequate' in to_text(found, 'angle')
    check_json(found)


def test_angles_shifted_after_the_recording_are_late(model):
    """Before the first of a trial arrives they hold it, though the drive has moved by then."""
    train, _ = recordings({}, 'arm-dynamic', (3,))
    angle = train.column('angle').copy()
    for _, part in train.split():
        angle[part] = np.interp(train.time[part] - 0.6, train.time[part], angle[part])
    shifted = Measurement.from_columns({**train.columns, 'angle': angle})
    found = diagnose(model, [shifted], RIVALS, seed=SEED)
    assert found.missing == ['latency'] and found.effects[0].held == 1.0
    # Of the rows every sixth is judged, 0.6 s apart.
    assert found.effects[0].delay == pytest.approx(0.6, abs=0.3)


def test_a_room_that_is_heated_in_turns_drifts(model, monkeypatch):
    """Up and down twice in two hours, as a thermometer would show that nobody has read."""
    monkeypatch.setattr(Air, 'recorded', lambda air, time: ROOM + 0.5 * air.swing * math.sin(
        2.0 * math.pi * time / air.period + air.phase))
    train, test = recordings({'ambient_temperature': 1.0}, trials=range(4))
    unread = [Measurement.from_columns({name: values for name, values in run.columns.items()
                                        if name != 'ambient_temperature'})
              for run in (train, test)]
    found = diagnose(model, unread[:1], seed=SEED)
    assert found.missing == ['ambient_drift'] and found.effects[0].sine != 0.0
    assert found.effects[0].period == pytest.approx(0.45 * 7200.0, rel=0.1)
    assert found.rmse_after < 0.3 * found.rmse_before


def test_a_heavier_payload_is_named_first_and_added(model):
    """With it the unseen recording is nearly as good as one without anything hidden."""
    train, test = recordings({'payload_error': 1.0})
    found = diagnose(model, [train], seed=SEED)
    assert found.verdict == 'missing' and found.missing[0] == 'payload_error'
    assert found.ranking[0]['effect'] == 'payload_error'
    assert found.rmse_after < 0.2 * found.rmse_before
    low, high = found.effects[0].intervals['dm']
    assert low < found.effects[0].values['dm'] < high
    check_json(found)
    assert 'Missing: payload_error' in to_text(found, 'angle')

    _, clean = recordings({})
    extended = extend(model, found.missing, [train]).model
    assert rmse(model, [test]) > 5.0 * rmse(model, [clean])
    # The load is now beyond what the bench has hung on the muscle.
    assert rmse(extended, [test]) < 1.8 * rmse(model, [clean])


@pytest.mark.parametrize('name', ['encoder_offset', 'backlash'])
def test_effects_of_sensor_and_mechanism_are_in_the_reported_set(model, name):
    """Which is small enough to act on."""
    train, test = recordings({name: 1.0})
    found = diagnose(model, [train], seed=SEED)
    assert found.verdict == 'missing'
    assert name in reported(found)
    assert len(reported(found)) <= 4
    extended = extend(model, found.missing, [train]).model
    assert rmse(extended, [test]) < 0.4 * rmse(model, [test])
    check_json(found)


def test_the_answer_is_the_most_probable_set(model):
    """And its residual without white noise is no more than the base model's own error."""
    train, _ = recordings({'payload_error': 1.0})
    found = diagnose(model, [train], ['payload_error', 'encoder_offset', 'supply_sag'], seed=SEED)
    assert found.sets[0]['effects'] == found.missing == ['payload_error']
    assert found.sets[0]['probability'] > 0.5
    assert {row['effect'] for row in found.ranking} == {
        'payload_error', 'encoder_offset', 'supply_sag'}
    check_json(found)


def test_a_lag_shows_in_transients(model):
    """In a continuous recording, among what could be mistaken for it."""
    train, _ = recordings({'thermal_lag': 1.0}, 'arm-dynamic', every=5)
    assert not train.settled
    found = diagnose(model, [train], RIVALS, seed=SEED)
    assert {row['effect'] for row in found.ranking} == set(RIVALS)
    assert found.verdict == 'missing' and 'thermal_lag' in reported(found)
    assert found.rmse_after < 0.5 * found.rmse_before
    check_json(found)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize('tau, dt, hold', [
    (0.05, 0.02, 1.0), (0.1, 0.02, 1.0), (100.0, 2.0, 150.0)])
def test_lags_at_the_ends_of_their_range_are_found(tau, dt, hold):
    """On a wire of other physics than the model's, where a fit from far away does not arrive."""
    model, _ = add_effects(*clean_bench(41, 'brinson'), [*UNIVERSAL, 'transformation_slopes'],
                           **TRIALS)
    plant, rows = Plant(41, {}, muscle='brinson', heat_time_constant=tau), round(30 * hold / dt)
    trials = []
    for trial in range(2):
        time = np.round(dt * np.arange(1, rows + 1), 4)
        levels = np.random.default_rng(trial).uniform(0.0, 6.0, 31)
        run = plant.arm_run(time, np.round(levels[(time / hold).astype(int)], 3))
        trials.append({**run, 'trial': np.full(rows, trial)})
    found = diagnose(model, [Measurement.from_columns({
        name: np.concatenate([run[name] for run in trials]) for name in trials[0]})])
    assert found.missing == ['thermal_lag']
    assert found.effects[0].time_constant == pytest.approx(tau, rel=0.03)


@pytest.mark.parametrize('names', [NEAR_SHAKEN, pytest.param(None, marks=pytest.mark.long)],
                         ids=['some', 'all'])
def test_what_no_catalogue_has_is_called_unknown(model, names):
    """A bench shaken by a machine: no name is forced on it."""
    train, _ = recordings({'unlisted_shaken_bench': 1.0})
    found = diagnose(model, [train], names, seed=SEED)
    assert found.verdict == 'unknown'
    assert found.unexplained > 0.3
    # What explains a part of it is not named as the cause.
    assert found.missing == [] and found.rmse_after == found.rmse_before
    unknown, = (one for one in found.sets if one['effects'] == ['unknown'])
    assert unknown['probability'] > 0.5
    assert 'Unknown' in to_text(found, 'angle')
    check_json(found)


def test_something_that_happened_once_is_told_by_its_time(model):
    """A crimp that slips looks like a drift or like fatigue to whoever needs a name."""
    train, _ = recordings({'unlisted_slipping_crimp': 1.0}, trials=(0, 1, 2, 3))
    found = diagnose(model, [train], ['ambient_drift', 'fatigue', 'slack', 'payload_error'],
                     seed=SEED)
    assert (found.verdict, found.missing) == ('unknown', [])
    # The laboratory lets it slip between 0.3 and 0.6 of the recording, 4 x 60 steps of 30 s.
    assert 0.3 * 7200.0 - 60.0 <= found.event <= 0.6 * 7200.0 + 60.0


def test_two_effects_that_one_could_explain_are_found_as_a_pair():
    """
    A dead zone and a sag look like a load that counts more.

    Where that leaves more than the base model is off by: on every other specimen it does not.
    """
    train, _ = recordings({'supply_sag': 1.0, 'pwm_dead_zone': 1.0}, trials=(0, 1, 2, 3), seed=12)
    found = diagnose(model_of(12), [train], ['stress_dependence', 'supply_sag', 'pwm_dead_zone'],
                     seed=SEED)
    assert {'supply_sag', 'pwm_dead_zone'} <= reported(found)


def of_the_model(model, train):
    """Return a recording as the model itself has it."""
    return Measurement.from_columns({**train.columns, 'angle': model.predict(train)})


@pytest.mark.parametrize('seed', [
    100, *(pytest.param(seed, marks=pytest.mark.long) for seed in (101, 102))])
def test_two_degrees_of_white_noise_on_the_models_own_response_are_adequate(model, seed):
    """
    The noise is estimated from the data; unknown is what has structure.

    Of a recording it is known to a few percent, which is more than the model's own error.
    """
    train, _ = recordings({})
    noise = math.radians(2.0) * np.random.default_rng(seed).standard_normal(train.rows)
    found = diagnose(model, [with_noise(of_the_model(model, train), noise)], seed=SEED)
    assert found.missing == [] and found.unexplained < 0.2
    assert found.noise_floor == pytest.approx(math.radians(2.0), rel=0.15)
    assert found.verdict == 'adequate'
    check_json(found)


@pytest.mark.parametrize('seat, zeroed', [
    (-0.9, 1.0), *(pytest.param(*ends, marks=pytest.mark.long)
                   for ends in ((-1.0, 1.0), (1.0, 1.0), (1.0, 0.0)))])
def test_a_play_is_one_wherever_in_it_the_encoder_was_zeroed(model, seat, zeroed):
    """A muscle that has cooled down has left it at one end; which one goes with the arm."""
    train, _ = recordings({})
    played = model.with_effects([*model.effects, effect_of(
        model, 'backlash', B=4.0, seat=seat, zeroed=zeroed)])
    rng = np.random.default_rng(4)
    found = diagnose(model, [with_noise(of_the_model(played, train), math.radians(0.1)
                                        * rng.standard_normal(train.rows))], seed=SEED)
    assert (found.verdict, found.missing) == ('missing', ['backlash'])
    assert found.effects[0].seat == pytest.approx(seat, abs=0.15)
    assert found.effects[0].zeroed == zeroed


@pytest.mark.long
def test_backlash_is_found_where_a_recording_begins_hot(model):
    """The muscles are hot, and where in its play the encoder lies nothing before has said."""
    train, _ = recordings({})
    later = {name: column[10:] for name, column in train.columns.items()}
    played = model.with_effects([*model.effects, effect_of(
        model, 'backlash', B=9.0, seat=1.0, zeroed=2.0)])
    rng = np.random.default_rng(4)
    train = Measurement.from_columns(later)
    found = diagnose(model, [with_noise(of_the_model(played, train), math.radians(0.1)
                                        * rng.standard_normal(train.rows))], seed=SEED)
    assert found.missing == ['backlash']
    assert found.effects[0].zeroed == 2.0
    assert found.effects[0].B == pytest.approx(9.0, abs=0.3)


@pytest.mark.parametrize('seed', range(3))
def test_noise_that_is_slow_is_not_taken_for_an_effect(model, seed):
    """One degree that changes from row to row by little: a drift of whatever cause has no name."""
    train, _ = recordings({})
    noise = autoregressive(np.random.default_rng(seed), 1, train.rows, 0.9)
    found = diagnose(model, [with_noise(train, math.radians(1.0) * noise)], seed=SEED)
    assert found.missing == []


def test_a_recording_that_the_model_predicts_exactly_is_adequate(model):
    """Without any error there is nothing to divide by."""
    train, _ = recordings({})
    found = diagnose(model, [of_the_model(model, train)], ['payload_error', 'supply_sag'])
    assert (found.verdict, found.missing) == ('adequate', [])
    assert found.rmse_before == 0.0
    assert all(row['gain'] == 0.0 for row in found.ranking)


@pytest.mark.parametrize('rows', [1, 2, 7])
def test_a_recording_too_short_to_judge_is_refused(model, rows):
    """One line says how many rows there are and how many it takes."""
    train, _ = recordings({})
    short = Measurement.from_columns(
        {name: values[:rows] for name, values in train.columns.items()})
    with pytest.raises(MeasurementError, match=f'at least 8 rows.* have {rows};'):
        diagnose(model, [short])


def test_an_effect_that_there_is_not_is_refused(model):
    """Before anything is computed."""
    train, _ = recordings({})
    with pytest.raises(ParameterError, match='gremlins'):
        diagnose(model, [train], ['gremlins'])


def test_effects_that_a_resting_arm_cannot_show_are_not_called_absent(model):
    """Without a voltage nothing is known of the drive, and all of the sensor's zero."""
    train, _ = recordings({})
    rows = 24
    still = {name: np.repeat(values[:1], rows) for name, values in train.columns.items()}
    still.update(time=30.0 * np.arange(1.0, rows + 1.0), trial=np.zeros(rows))
    still['voltage'] = np.zeros(rows)
    found = diagnose(model, [Measurement.from_columns(still)], seed=SEED)
    assert (found.verdict, found.missing) == ('not_excited', [])
    assert {'supply_sag', 'airflow', 'backlash', 'thermal_lag'} <= set(found.not_excited)
    # The resting angle still shows these.
    assert not {'encoder_offset', 'frame_tilt'} & set(found.not_excited)
    assert not any(math.isnan(row['rmse_after']) for row in found.ranking)
    check_json(found)


def test_the_same_recording_gives_the_same_answer_whatever_the_jobs(model):
    """Random draws are seeded, and forks return what one process would."""
    some = ['payload_error', 'encoder_offset', 'resistance_change']
    train, _ = recordings({'payload_error': 1.0})
    one, two = (diagnose(model, [train], some, jobs=jobs,
                         seed=3).to_dict() for jobs in (1, 2))
    assert one == two
    assert set(one) == {field.name for field in dataclasses.fields(Diagnosis)}
