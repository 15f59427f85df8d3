# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""A room whose temperature was recorded: what it explains, and what it must not take up."""

import types

import numpy as np
import pytest

from hysteresis_ros.diagnosis import bench_effects, selection
from hysteresis_ros.diagnosis.bench_effects import add_effects
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.discrepancy import discrepancy_along, room_change, room_is_calm
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.observable import observable
from hysteresis_ros.diagnosis.parameters import usual
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.effects import catalogue
from hysteresis_ros.effects.ambient import AmbientTemperature
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory import sequences
from hysteresis_ros.laboratory.bench import Bench, HOLD
from hysteresis_ros.laboratory.conditions import Air, Conditions
from hysteresis_ros.laboratory.experiments import experiment_tables, LOADS
from hysteresis_ros.laboratory.plant import specimen
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import MuscleModel
from model_support import bicep_model, effect_of, runs, with_noise

MODEL = bicep_model()
# A warm and a cold hour, as a thermostat makes them.
WANDER = np.sin(np.arange(120) / 9.0)
SEVERAL = ['ambient_temperature', 'payload_error', 'airflow', 'supply_sag', 'encoder_offset',
           'pwm_dead_zone', 'fatigue']


def in_room(ambient, reference, *others, gain=0.4, seed=0):
    """Return an arm run in a recorded room [degC], of a muscle whose bench had another one."""
    run = runs(MODEL, trials=4, rows=30, seed=seed)
    run = Measurement.from_columns({**run.columns, 'ambient_temperature': ambient + np.zeros(120)})
    room = effect_of(MODEL, 'ambient_temperature', gain=gain, reference=reference)
    return Measurement.from_columns({
        **run.columns, 'angle': MODEL.with_effects([room, *others]).predict(run)})


def bench_in_room(swing, seed=8701, random=(False, True)):
    """Return the length table of a wire whose room swings by so many kelvins, and is recorded."""
    air = Air(swing=swing, period=5400.0, phase=1.0)
    bench = Bench(Conditions(material=specimen(seed, 'grains'), air=air), seed=seed)
    rng, columns = np.random.default_rng(seed), []
    for trial, (load, steps) in enumerate((load, steps) for steps in random for load in LOADS):
        drive = sequences.random_steps(40, rng) if steps else sequences.damped_oscillation()
        room = [air.recorded(bench.time + HOLD * (n + 1)) for n in range(len(drive))]
        columns.append([np.full(len(drive), trial), np.arange(len(drive)), drive,
                        np.full(len(drive), load), bench.length_trial(drive, load), room])
    return Measurement.from_columns(dict(zip(
        ('trial', 'step', 'voltage', 'force', 'length', 'ambient_temperature'),
        np.concatenate(columns, axis=1))))


def without_thermometer(table):
    """Return the same table as if nobody had recorded the room."""
    return Measurement.from_columns({name: column for name, column in table.columns.items()
                                     if name != 'ambient_temperature'})


def verified(table, names):
    """Return the error [m] of the trials that verify, and the effects that were added."""
    force = Measurement.from_columns(experiment_tables('bench', {}, 8701)['force.csv'])
    fitted = {'length_trials': range(len(LOADS)), 'force_trials': [0]}
    plain = identify(table, force, **fitted).model
    model, added = add_effects(plain, table, force, names, **fitted)
    return model.metrics['length']['verification']['rmse'], added


def discrepancy_of(problem, room):
    return discrepancy_along(problem, [], problem.simulate([]), Settings(), (), room)


@pytest.mark.parametrize('days', [(22.0,), (22.0, 22.3), (22.0, 26.0)])
def test_a_cold_and_a_warm_day_are_a_change(days):
    """Within neither the room has to change: that is what the effect's experiment asks for."""
    problem = problem_for(MODEL, [in_room(day, 22.0, seed=number)
                                  for number, day in enumerate(days)])
    names, unobservable = observable(problem)
    assert ('ambient_temperature' in names) == (np.ptp(days) > 0.5)
    assert 'ambient_temperature' in {*names, *unobservable}


def test_a_day_without_a_thermometer_does_not_hide_the_other_two():
    """Nor do values that are not there."""
    plain = runs(MODEL, trials=4, rows=30, seed=5)
    warm = in_room(26.0, 22.0)
    warm.columns['ambient_temperature'][3] = np.nan
    names, _ = observable(problem_for(MODEL, [in_room(22.0, 22.0), plain, warm]))
    assert 'ambient_temperature' in names


def test_a_cold_and_a_warm_day_name_the_room():
    found = diagnose(MODEL, [in_room(day, 22.0, seed=number)
                             for number, day in enumerate((21.0, 27.0))], SEVERAL)
    assert (found.verdict, found.missing, found.alternatives) == (
        'missing', ['ambient_temperature'], [[]])
    effect, = found.effects
    assert (effect.gain, effect.reference) == pytest.approx((0.4, 22.0), rel=0.1)


def test_a_room_that_wanders_little_is_an_error_of_known_course():
    problem = problem_for(MODEL, [in_room(22.0 + 0.2 * WANDER, 22.0)])
    change = room_change(problem, [])
    gain = MODEL.surroundings.full_drive_squared / 80.0
    moved = problem.simulate([effect_of(
        MODEL, 'ambient_temperature', gain=gain,
        reference=float(np.mean(problem.ambient)))])
    np.testing.assert_allclose(change, moved - problem.simulate([]), atol=1e-12)
    without, with_it = (discrepancy_of(problem, room) for room in (False, True))
    assert room_is_calm(problem, without)
    np.testing.assert_array_equal(with_it.common[:, -1], change)
    assert with_it.common.shape[1] == without.common.shape[1] + 1
    # Where the effect acts itself, its own gain says what the room does.
    assert not np.any(room_change(problem, [effect_of(MODEL, 'ambient_temperature')]))


def test_a_room_that_moves_the_arm_by_more_is_for_the_effect_to_explain():
    problem = problem_for(MODEL, [in_room(22.0 + 5.0 * WANDER, 22.0)])
    assert not room_is_calm(problem, discrepancy_of(problem, False))
    still = problem_for(MODEL, [in_room(22.0, 22.0)])
    assert not np.any(room_change(still, []))
    assert not room_is_calm(still, discrepancy_of(still, False))


def test_a_wandering_room_does_not_speak_against_another_effect(monkeypatch):
    """The effect follows the recorded course, and a bench in another room would do the rest."""
    run = in_room(22.0 + 0.4 * WANDER, 22.0, effect_of(MODEL, 'pwm_dead_zone', Vd=0.4))
    slow = np.convolve(np.random.default_rng(3).standard_normal(131), np.ones(12), 'valid')
    run = with_noise(run, np.radians(0.3) * slow / np.std(slow))

    def share_of_the_room():
        found = diagnose(MODEL, [run], SEVERAL)
        assert found.missing == ['pwm_dead_zone']
        return sum(entry['probability'] for entry in found.sets
                   if 'ambient_temperature' in entry['effects'])
    share = share_of_the_room()
    monkeypatch.setattr(selection, 'room_is_calm', lambda *_: False)
    assert share < 0.02 and share_of_the_room() > 0.1


@pytest.mark.parametrize('drive, counts', [
    ('voltage', True), ('power', True), ('pressure', False), ('temperature', False)])
def test_a_room_counts_where_the_drive_heats(drive, counts):
    """The air does nothing to a pressure, and a wire's own temperature has it in it."""
    run = in_room(22.0 + 0.2 * WANDER, 22.0)
    model = bicep_model(drive=drive, ranges={**MODEL.ranges, drive: MODEL.ranges['voltage']})
    columns = {**run.columns, drive: run.columns['voltage']}
    if drive != 'voltage':
        del columns['voltage']
    problem = problem_for(model, [Measurement.from_columns(columns)])
    assert np.any(room_change(problem, [])) == counts


def test_a_room_that_wanders_far_is_named():
    found = diagnose(MODEL, [in_room(22.0 + 4.0 * WANDER, 22.0)], SEVERAL)
    assert (found.verdict, found.missing) == ('missing', ['ambient_temperature'])


def test_a_bench_whose_room_was_recorded_says_what_the_reference_is(tmp_path):
    tables = experiment_tables('bench', {}, 3)
    length = tables['length.csv']
    room = 21.0 + 0.4 * np.sin(np.arange(len(length['voltage'])))
    model = identify(Measurement.from_columns({**length, 'ambient_temperature': room}),
                     Measurement.from_columns(tables['force.csv'])).model
    model.save(tmp_path / 'model.yaml')
    model = MuscleModel.load(tmp_path / 'model.yaml')
    assert model.surroundings.ambient == pytest.approx((20.6, 21.4), abs=1e-3)
    _, reference = AmbientTemperature.describe(model.surroundings)
    assert (reference.low, reference.neutral, reference.high) == pytest.approx(
        (19.6, 21.0, 22.4), abs=1e-3)
    assert MODEL.surroundings.ambient is None
    assert AmbientTemperature.describe(MODEL.surroundings) == AmbientTemperature.parameters


@pytest.mark.slow
def test_of_a_bench_in_the_same_room_nothing_else_is_taken_for_it():
    """And of one in another room nothing else is named."""
    model = bicep_model(ranges={**MODEL.ranges, 'ambient_temperature': (21.8, 22.2)})
    heavy = in_room(22.0 + 0.4 * WANDER, 22.0, effect_of(MODEL, 'airflow', beta=1.1))
    found = diagnose(model, [heavy], SEVERAL)
    assert found.missing[0] in ('airflow', 'supply_sag')
    assert not any('ambient_temperature' in entry['effects'] for entry in found.sets)
    found = diagnose(model, [in_room(27.0 + 0.4 * WANDER, 22.0)], SEVERAL)
    assert (found.missing, found.alternatives) == (['ambient_temperature'], [[]])
    assert found.effects[0].gain == pytest.approx(0.4, rel=0.15)


def test_a_room_as_warm_all_the_time_counts_where_the_bench_had_another_one():
    """The difference was recorded, if on two days; without the bench's nothing is known of it."""
    model = bicep_model(ranges={**MODEL.ranges, 'ambient_temperature': (21.8, 22.2)})
    warm = in_room(25.0, 22.0)
    assert 'ambient_temperature' in observable(problem_for(model, [warm]))[0]
    assert 'ambient_temperature' not in observable(problem_for(MODEL, [warm]))[0]
    found = diagnose(model, [warm], SEVERAL)
    assert 'ambient_temperature' in {*found.missing, *sum(found.alternatives, [])}
    problem = problem_for(model, [in_room(22.3, 22.0)])
    moved = problem.simulate([effect_of(
        model, 'ambient_temperature', gain=model.surroundings.full_drive_squared / 80.0,
        reference=22.0)])
    assert np.any(room_change(problem, []))
    np.testing.assert_allclose(room_change(problem, []), moved - problem.simulate([]), atol=1e-12)


def test_the_bench_of_the_laboratory_feels_its_room():
    """Trials follow each other, and the wire is as warm as the air before each of them."""
    calm, swinging = (bench_in_room(swing, random=(False,)) for swing in (0.0, 3.0))
    room = swinging.column('ambient_temperature')
    assert np.ptp(calm.column('ambient_temperature')) == 0.0 and 3.0 < np.ptp(room) < 6.0
    again = bench_in_room(0.0, random=(False,))
    np.testing.assert_array_equal(calm.column('length'), again.column('length'))
    change = swinging.column('length') - calm.column('length')
    halfway = np.abs(calm.column('voltage') - 3.6) < 0.7
    # Warm air heats as the drive does, and a wire that is heated gets shorter.
    assert np.corrcoef(room[halfway], change[halfway])[0, 1] < -0.5
    assert np.ptp(change) > 1e-3


@pytest.mark.long
def test_a_bench_says_how_much_its_recorded_room_counts():
    table = bench_in_room(3.0)
    own = ['stress_dependence', 'series_compliance', 'stress_dependent_strain']
    worse, _ = verified(table, own)
    error, added = verified(table, [*own, 'ambient_temperature'])
    room = added[-1]
    assert error < 0.5 * worse
    # In the laboratory 36 V^2 heat by 97 K.
    assert room.gain == pytest.approx(36.0 / 97.0, rel=0.15)
    assert 'gain' in room.intervals and 'reference' not in room.intervals


class Asked(Exception):
    """What was asked of a diagnosis that nobody has the time for."""


@pytest.mark.slow
@pytest.mark.parametrize('swing, recorded, counts', [
    (3.0, True, True), (3.0, False, False), (0.1, True, False)])
def test_a_recorded_room_acts_while_a_bench_is_diagnosed(monkeypatch, swing, recorded, counts):
    """As strongly as is usual: what the load does would else stand for it."""
    table = bench_in_room(swing, random=(False,))
    if not recorded:
        table = without_thermometer(table)

    def diagnose_nothing(model, *args, **options):
        raise Asked(model)
    monkeypatch.setattr(bench_effects, 'diagnose', diagnose_nothing)
    with pytest.raises(Asked) as asked:
        add_effects(identify(table).model, table)
    model, = asked.value.args
    assert [effect.id for effect in model.effects] == ['ambient_temperature'] * counts
    for effect in model.effects:
        assert effect.gain == pytest.approx(36.0 / 80.0)
        assert effect.reference == pytest.approx(
            np.mean([f(table.column('ambient_temperature')) for f in (np.min, np.max)]))


def test_a_rooms_gain_is_fitted_with_what_was_found(monkeypatch):
    """Before anything is taken away again; nothing else fits it where nothing is."""
    table = bench_in_room(3.0, random=(False,))
    surroundings = identify(table).model.surroundings
    own = usual([catalogue()[name](surroundings) for name in (
        'stress_dependence', 'series_compliance', 'stress_dependent_strain')], 'bench')

    def determine_nothing(model, found, problem):
        raise Asked(found)
    monkeypatch.setattr(bench_effects, 'diagnose',
                        lambda *args, **options: types.SimpleNamespace(effects=own))
    monkeypatch.setattr(bench_effects, '_determined', determine_nothing)
    with pytest.raises(Asked) as asked:
        add_effects(identify(table).model, table)
    found, = asked.value.args
    assert [effect.id for effect in found] == [*(one.id for one in own), 'ambient_temperature']
    assert found[-1].gain == pytest.approx(36.0 / 97.0, rel=0.15)
    assert set(found[-1].intervals) == {'gain'}


@pytest.mark.long
def test_a_bench_in_a_swinging_room_lacks_that_and_what_the_wire_has():
    table = bench_in_room(3.0)
    error, added = verified(table, None)
    blind, _ = verified(without_thermometer(table), None)
    room, = (effect for effect in added if effect.id == 'ambient_temperature')
    assert room.gain == pytest.approx(36.0 / 97.0, rel=0.15)
    assert error < 1e-4 and blind > 2.5e-4
    calm, named = verified(bench_in_room(0.0), None)
    assert 'ambient_temperature' not in [effect.id for effect in named]
    assert error < 1.2 * calm
