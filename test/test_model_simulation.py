# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulation of whole measurements: trials, sets, phases, and the paper's linear model."""

import math

import numpy as np
import pytest
from scipy import optimize

from hysteresis_ros.bicep.balance import ArmBalance
from hysteresis_ros.effects import SensorEffect
from hysteresis_ros.errors import ModelFileError, ParameterError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import LinearModel, simulation, Simulator
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.trials import trials_of
from model_support import (
    arm_run, bicep_model, effect_of, GEOMETRY, runs, STRENGTHS, wandering_voltage)

VOLTAGE = wandering_voltage(800, seed=2)
STRONG = {'latent_heat': {'latent': 0.5}, 'creep': {'c': 0.3}, 'resistance_change': {'eta': 0.2}}


def table(trials=((0.0, 4.0, 2.0), (1.0, 5.0)), **columns):
    """A length table of trials without times."""
    voltage = np.concatenate(trials)
    return Measurement.from_columns({
        'trial': np.concatenate([np.full(len(t), n) for n, t in enumerate(trials)]),
        'step': np.concatenate([np.arange(len(t)) for t in trials]), 'voltage': voltage,
        'force': np.full(len(voltage), 4.0), 'length': np.zeros(len(voltage)), **columns})


def test_trials_carry_time_clock_and_cycles():
    model = bicep_model()
    first, second = trials_of(model, table())
    assert first.inputs.time.tolist() == [30.0, 60.0, 90.0]
    assert first.inputs.dt.tolist() == [30.0, 30.0, 30.0]
    assert second.inputs.clock.tolist() == [120.0, 150.0]
    np.testing.assert_allclose(first.inputs.cycles, np.array([0.0, 4.0, 6.0]) / 12.0)
    # Each trial starts from no voltage.
    np.testing.assert_allclose(second.inputs.cycles, np.array([7.0, 11.0]) / 12.0)
    assert np.all(np.isnan(first.inputs.ambient))
    assert (second.rows.start, second.drive.tolist(), second.load.tolist()) == (
        3, [1.0, 5.0], [4.0, 4.0])


def test_time_of_a_recording_counts_from_the_start_of_the_trial():
    trial, = trials_of(bicep_model(), arm_run([1.0, 2.0, 3.0], 0.5, first=0.0,
                                              ambient_temperature=[20.0, 21.0, 22.0]))
    assert trial.inputs.dt.tolist() == [0.0, 0.5, 0.5]
    assert trial.inputs.ambient.tolist() == [20.0, 21.0, 22.0]
    assert trial.load.tolist() == [0.0, 0.0, 0.0]


def test_the_first_settled_row_is_settled_even_at_time_zero():
    model = bicep_model(['thermal_lag', 'viscous_friction'])
    late, early = (model.predict(arm_run([4.0, 1.0], 30.0, first=first)) for first in (30.0, 0.0))
    np.testing.assert_allclose(early, late, atol=1e-9)
    assert late[0] < 1.7


@pytest.mark.parametrize('settled', [False, True])
@pytest.mark.parametrize('name', sorted(STRENGTHS))
def test_trials_taken_from_a_recording_are_predicted_as_in_it(name, settled):
    model = bicep_model()
    whole = runs(model, trials=4, rows=30, dt=30.0 if settled else 5.0)
    model = model.with_effects([effect_of(model, name)])
    taken = whole.select([1, 3])
    np.testing.assert_allclose(
        model.predict(taken), model.predict(whole)[np.isin(whole.column('trial'), [1, 3])],
        atol=1e-5)


def test_memory_is_wiped_between_trials():
    model = bicep_model()
    both = model.predict(table(((0.0, 6.0, 2.0), (2.0, 5.0))))
    alone = model.predict(table(((2.0, 5.0),)))
    np.testing.assert_array_equal(both[3:], alone)
    assert both[2] != alone[0]


def test_force_table_is_the_first_stage_of_the_felt_voltage():
    model = bicep_model(['supply_sag'])
    voltage = np.array([1.0, 5.0, 2.0, 3.0])
    run = Measurement.from_columns({'trial': np.zeros(4), 'step': np.arange(4),
                                    'voltage': voltage, 'force': np.zeros(4)})
    stage = bicep_model().force_stage
    stage.reset()
    np.testing.assert_allclose(model.predict(run),
                               [stage.step(v * 8.0 / 8.4) for v in voltage], atol=1e-12)
    before = model.force_stage.save()
    model.predict(run)
    assert model.force_stage.save() == before
    changing = model.with_effects([effect_of(model, 'resistance_change')])
    assert np.all(np.isfinite(changing.predict(run)))
    with pytest.raises(ParameterError, match='no force stage'):
        bicep_model(force_stage=None).predict(run)


def test_an_arm_run_without_a_first_stage_ignores_the_load():
    model = bicep_model(force_stage=None, load_name=None, mean_load=0.0)
    voltage = np.array([1.0, 5.0, 2.0, 3.0])
    stage = model.require_length_stage()
    stage.step(0.0)
    lengths = [stage.step(-v) for v in voltage]
    np.testing.assert_allclose(GEOMETRY.length(model.predict(arm_run(voltage))), lengths, atol=2e-8)


@pytest.mark.parametrize('names', [
    (), *((name,) for name in STRENGTHS), ('thermal_lag', 'coulomb_friction', 'backlash'),
    ('unequal_muscles', 'coulomb_friction'), ('fatigue', 'latency')])
def test_judged_rows_are_the_same_where_the_others_are_interpolated(names):
    model = bicep_model()
    # Ramps with holds and reversals between them, such as a recording in motion has.
    voltage = np.repeat(VOLTAGE[::20], [1, 30] * 20)
    voltage[200:600] = VOLTAGE[200:600]
    run = arm_run(voltage, 0.1, cycles=np.zeros(len(voltage)))
    judged = np.arange(0, len(voltage), 23)
    effects = [effect_of(model, name) for name in names]
    found, whole = (Simulator(model, run, rows).run(effects)[judged] for rows in (judged, None))
    # What depends on the phase needs all rows, and is only brought into agreement so far.
    away = 2e-3 if any(effect.needs_phase for effect in effects) else 1e-6
    if 'viscoelastic_creep' in names:
        # Against a slow drive it may turn the muscle where no input turns.
        away = 2e-5
    np.testing.assert_allclose(found, whole, rtol=0.0, atol=away)


def test_an_arm_at_rest_is_balanced_where_it_is_judged_and_where_an_input_turns(monkeypatch):
    model, balanced = bicep_model(), []
    run_trials = ArmBalance.run

    def count(balance, cold, ends, x, *columns):
        balanced.append(len(x))
        return run_trials(balance, cold, ends, x, *columns)

    monkeypatch.setattr(ArmBalance, 'run', count)
    run = arm_run(np.concatenate([np.linspace(0.0, 6.0, 300), np.full(100, 6.0),
                                  np.linspace(6.0, 1.0, 300)]), 0.1)
    judged = np.array([150, 350, 500])
    for names in ((), ('viscous_friction',)):
        Simulator(model, run, judged).run([effect_of(model, name) for name in names])
    # Three judged, the first and the last, begin and end of the hold; all where velocity counts.
    assert balanced[0] <= 8 and balanced[1] == 700
    Simulator(model, run, judged).run([], exact=True)
    assert balanced[2] == 700


@pytest.mark.parametrize('name', ['payload_error', 'thermal_lag', 'resistance_change'])
@pytest.mark.parametrize('exact', [True, False])
def test_trials_of_different_lengths_are_those_of_recordings_of_their_own(name, exact):
    model = bicep_model()
    effect = effect_of(model, name)
    lengths = [50, 120, 80]
    ends = np.cumsum(lengths)
    whole = arm_run(VOLTAGE[:ends[-1]], trial=np.repeat([0.0, 1.0, 2.0], lengths),
                    time=np.concatenate([0.1 * np.arange(1, length + 1) for length in lengths]))
    found = Simulator(model, whole).run([effect], exact=exact)
    alone = [Simulator(model, arm_run(VOLTAGE[end - length:end], 0.1)).run([effect], exact=exact)
             for length, end in zip(lengths, ends)]
    np.testing.assert_allclose(found, np.concatenate(alone), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize('name', ['latent_heat', 'resistance_change', 'creep'])
def test_the_phase_counts_between_the_rows_that_are_judged(name):
    model = bicep_model()
    effect = effect_of(model, name, **{**STRENGTHS[name], **STRONG.get(name, {})})
    run = arm_run(np.concatenate([np.linspace(0.0, 6.0, 200), np.linspace(6.0, 2.5, 40)]), 0.1)
    judged = np.array([run.rows - 1])
    found, whole = (Simulator(model, run, rows).run([effect])[judged] for rows in (judged, None))
    np.testing.assert_allclose(found, whole, rtol=0.0, atol=1e-3)


def test_a_sensor_effect_that_does_not_say_what_it_reads_gets_all_rows():
    class Smoothed(SensorEffect):
        id = 'smoothed'

        def forward(self, response, inputs):
            return np.convolve(response, np.full(9, 1.0 / 9.0), 'same')

    model = bicep_model()
    judged = np.arange(0, len(VOLTAGE), 23)
    found, whole = (Simulator(model, arm_run(VOLTAGE, 0.1), rows).run([Smoothed()])[judged]
                    for rows in (judged, None))
    np.testing.assert_array_equal(found, whole)


@pytest.mark.parametrize('jobs', [1, 2])
def test_many_sets_in_one_call_are_those_of_single_runs(jobs):
    model = bicep_model()
    columns = arm_run(VOLTAGE, 0.1).columns
    run = Measurement.from_columns({**columns, 'trial': np.arange(len(VOLTAGE)) // 300})
    sets = [[effect_of(model, name) for name in names]
            for names in ((), *((name,) for name in STRENGTHS), ('inertia', 'unequal_muscles'))]
    found = Simulator(model, run).run_many(sets, jobs=jobs)
    assert found.shape == (len(sets), len(VOLTAGE))
    for effects, rows in zip(sets, found):
        np.testing.assert_array_equal(rows, Simulator(model, run).run(effects))
    assert len(np.unique(found, axis=0)) > 20


def test_no_more_balances_are_kept_than_asked_for(monkeypatch):
    """Thousands of payloads must not fill the memory."""
    monkeypatch.setattr(simulation, 'MOST_BALANCES', 3)
    model = bicep_model()
    simulator = Simulator(model, arm_run([1.0, 4.0]))
    sets = [[effect_of(model, 'payload_error', dm=float(dm))] for dm in range(8)]
    found = simulator.run_many(sets)
    assert len(simulator._balances) <= 3
    np.testing.assert_array_equal(found[0], Simulator(model, arm_run([1.0, 4.0])).run(sets[0]))


def test_no_sets_are_no_rows():
    assert Simulator(bicep_model(), arm_run([1.0, 2.0])).run_many([]).shape == (0, 2)


@pytest.mark.parametrize('jobs', [1, 2])
def test_an_error_in_one_of_many_sets_is_raised(jobs):
    simulator = Simulator(bicep_model(geometry=None), arm_run([1.0, 2.0]))
    with pytest.raises(ParameterError, match='no arm geometry'):
        simulator.run_many([[], []], jobs=jobs)


def test_phase_is_in_agreement_with_the_response_it_causes():
    model = bicep_model()
    effect = effect_of(model, 'resistance_change', eta=0.05)
    run = arm_run([3.5, 4.0, 2.5])
    angles = Simulator(model, run).run([effect])
    phase = model.martensite(GEOMETRY.length(angles))
    assert np.all((phase > 0.0) & (phase < 1.0))
    felt = np.array([3.5, 4.0, 2.5]) * np.sqrt(1.0 / (1.0 + 0.05 * phase))
    np.testing.assert_allclose(model.predict(arm_run(felt)), angles, atol=math.radians(0.05))


@pytest.mark.parametrize('name, values', [
    ('latent_heat', {'time_constant': 3.0, 'latent': 0.6}), ('creep', {'c': 0.3, 't0': 2.0})])
def test_a_strong_effect_of_the_phase_agrees_with_the_phase_it_causes(monkeypatch, name, values):
    """Latent heat works against its cause, so that plain repetition would swing to and fro."""
    model = bicep_model()
    effect = effect_of(model, name, **values)
    simulator = Simulator(model, arm_run(VOLTAGE, 0.1))
    given = outputs_given(monkeypatch)
    angles = simulator.run([effect])
    trial, = simulator.trials
    respond = simulator._responder(Chain([effect], model.surroundings))
    trial.inputs = trial.inputs._replace(phase=model.martensite(given[-1]))
    again, = respond([trial])
    assert np.sqrt(np.mean((again.values - angles) ** 2)) < math.radians(0.1)


@pytest.mark.parametrize('jobs', [1, 2])
def test_a_run_after_another_needs_fewer_passes_and_gives_the_same(monkeypatch, jobs):
    """It begins with the phase of the run before, even if that failed."""
    model = bicep_model()
    effects = [[effect_of(model, 'resistance_change', eta=eta)] for eta in (0.2, 0.19)]
    given = outputs_given(monkeypatch)
    fresh, counts = [], []
    for one in effects:
        fresh.append(Simulator(model, arm_run(VOLTAGE)).run(one))
        counts.append(len(given))
    simulator = Simulator(model, arm_run(VOLTAGE))
    simulator.run(effects[0])
    with monkeypatch.context() as broken:
        broken.setattr(Simulator, '_phase', lambda self, output: np.nan * output)
        simulator.run(effects[0])
    given.clear()
    found = simulator.run_many(effects[1:] * 2, jobs)
    assert len(given) < 2 * (counts[1] - counts[0])
    for angles in found:
        np.testing.assert_allclose(angles, fresh[1], atol=math.radians(0.1))
    np.testing.assert_array_equal(found[0], found[1])


def test_another_set_begins_with_the_phase_of_the_run_before(monkeypatch):
    """Most sets that are compared change the phase little, so that fewer passes do."""
    model = bicep_model()
    effects = [effect_of(model, 'creep'), effect_of(model, 'payload_error', dm=1.0)]
    given = outputs_given(monkeypatch)
    Simulator(model, arm_run(VOLTAGE, 0.1)).run(effects)
    fresh = len(given)
    simulator = Simulator(model, arm_run(VOLTAGE, 0.1))
    simulator.run(effects[:1])
    given.clear()
    simulator.run(effects)
    assert len(given) < fresh


def test_a_run_is_never_that_of_the_phase_before(monkeypatch):
    """However small the step of a parameter, or derivatives would lack what the phase answers."""
    model = bicep_model()
    simulator = Simulator(model, arm_run(VOLTAGE))
    given = outputs_given(monkeypatch)
    simulator.run([effect_of(model, 'resistance_change', eta=0.2)])
    first = len(given)
    simulator.run([effect_of(model, 'resistance_change', eta=0.2001)])
    assert first > 2 and len(given) - first == 2


def outputs_given(monkeypatch):
    """Return a list that takes the outputs of H2 from which the share of martensite follows."""
    given = []
    phase = Simulator._phase
    monkeypatch.setattr(
        Simulator, '_phase', lambda self, output: given.append(output) or phase(self, output))
    return given


def test_only_what_transforms_counts_as_transformation_on_an_arm(monkeypatch):
    """Creep and elastic stretch move the arm, too; as martensite, creep would feed itself."""
    model = bicep_model(['series_compliance'])
    creep = effect_of(model, 'creep', c=0.3, t0=2.0)
    given = outputs_given(monkeypatch)
    simulator = Simulator(model, arm_run(VOLTAGE, 0.5))
    angles = simulator.run([*model.effects, creep])
    trial, = simulator.trials
    chain = Chain([*model.effects, creep], model.surroundings)
    # The phase that counted in the last pass is within what agreement allows of its output's.
    inputs = trial.inputs._replace(phase=model.martensite(given[-1]))
    offset, _ = chain.drift(trial.drive, chain.drive_squared(trial.drive, inputs), inputs)
    stretch = chain.stretch(GEOMETRY.force(angles))
    np.testing.assert_allclose(
        given[-1], GEOMETRY.length(angles) - stretch - offset, atol=2e-5)
    assert np.ptp(offset) > 2e-4 and np.min(stretch) > 1e-4


def test_of_the_passes_for_the_phase_the_last_ones_inputs_are_given():
    """One entry a trial, however often it was run; a diagnosis of an extended model needs them."""
    model = bicep_model(['creep'])
    run = arm_run(VOLTAGE, 0.5)
    run = Measurement.from_columns({
        **run.columns, 'trial': np.arange(len(VOLTAGE)) // 300})
    seen = []
    Simulator(model, run).run(model.effects, seen)
    assert [len(inputs) for inputs in seen] == [300, 300, 200]


def test_martensite_is_the_long_phase_of_a_muscle_that_contracts():
    model = bicep_model()
    low, high = model.length_stage.output_range
    assert model.martensite(high + 1.0) == 1.0 and model.martensite(low - 1.0) == 0.0
    assert model.martensite(low + 0.25 * (high - low)) == pytest.approx(0.25)
    assert bicep_model(sign=1).martensite(high) == 0.0
    with pytest.raises(ModelFileError, match='no length stage'):
        bicep_model(length_stage=None).martensite(0.0)


def test_sensor_effects_reach_bench_tables():
    run = table()
    plain = bicep_model().predict(run)
    late = bicep_model(['latency']).predict(run)
    assert late[0] == plain[0]
    assert late[1] == pytest.approx(plain[1] + (plain[0] - plain[1]) * 0.35 / 30.0)


def test_muscle_says_what_scales_effects_refer_to():
    surroundings = bicep_model().surroundings
    assert surroundings._asdict() == {
        'length': 0.27, 'load': 3.0, 'full_drive_squared': 36.0, 'span': pytest.approx(0.0205),
        'drive': 'voltage', 'load_name': 'force', 'response': 'length', 'cold': 0.0,
        'drive_range': 6.0, 'sign': -1, 'rest_load': 0.5, 'least': pytest.approx(-0.0205),
        'muscles': 3, 'operator': 'preisach', 'ambient': None,
        # 100 g at the end of a forearm of 0.3 m and 40 g, and a clamp at 17 mm.
        'mass': pytest.approx(0.14), 'moment': pytest.approx(9.81 * 0.3 * 0.12),
        'inertia': pytest.approx(0.1 * 0.3 ** 2 + 0.04 * 0.3 ** 2 / 3.0), 'lever': 0.017}
    hot = bicep_model(drive='temperature', response='strain', geometry=None, sign=1,
                      ranges={'temperature': (20.0, 150.0), 'strain': (0.0, 0.04)}).surroundings
    assert (hot.length, hot.full_drive_squared, hot.cold, hot.drive_range, hot.sign) == (
        1.0, 150.0, 20.0, 130.0, 1)
    assert bicep_model(geometry=None).surroundings.length == pytest.approx(20.0 * 0.0205)


def test_unknown_method_is_refused():
    with pytest.raises(ParameterError, match="must be preisach or linear, not 'magic'"):
        bicep_model().predict(table(), 'magic')


LINEAR = LinearModel(2.69, 0.88e-3, -0.15)


def test_linear_model_is_that_of_the_paper():
    assert LINEAR.force(2.0) == pytest.approx(2.69 * 2.0 - 0.15)
    # L = k2 (F - k1 V - F0), k2 in mm/N
    assert LINEAR.length(2.0, 9.0) == pytest.approx(0.88e-3 * (9.0 - 2.69 * 2.0 + 0.15))
    assert LINEAR.length(LINEAR.drive_for_length(1e-3, 9.0), 9.0) == pytest.approx(1e-3)
    assert LINEAR.length(LINEAR.drive_for_force(7.0), 7.0) == pytest.approx(0.0)
    assert LINEAR.force(LINEAR.drive_for_force(7.0)) == pytest.approx(7.0)
    assert LinearModel.from_dict(LINEAR.to_dict()) == LINEAR


def test_linear_predictions_of_the_bench():
    model = bicep_model(linear=LINEAR)
    run = table()
    np.testing.assert_allclose(model.predict(run, 'linear'),
                               LINEAR.length(run.column('voltage'), 4.0))
    force = Measurement.from_columns({'trial': np.zeros(2), 'step': np.arange(2),
                                      'voltage': np.array([1.0, 2.0]), 'force': np.zeros(2)})
    np.testing.assert_allclose(model.predict(force, 'linear'), LINEAR.force([1.0, 2.0]))
    bare = Measurement.from_columns({'trial': np.zeros(2), 'voltage': np.array([1.0, 2.0]),
                                     'length': np.zeros(2)})
    np.testing.assert_allclose(model.predict(bare, 'linear'), LINEAR.length([1.0, 2.0], 0.0))


def test_linear_prediction_of_the_arm_balances_it():
    model = bicep_model(linear=LinearModel(2.69, 1.3e-3, 9.0))
    voltage = np.array([1.0, 2.0, 3.0])
    angles = model.predict(arm_run(voltage), 'linear')
    for volts, angle in zip(voltage, angles):
        expected = optimize.brentq(lambda theta, v=volts: float(
            GEOMETRY.length(theta) - model.linear.length(v, GEOMETRY.force(theta))), 0.8, 2.6)
        assert angle == pytest.approx(expected, abs=2e-5)
    assert np.all(np.diff(angles) < 0.0)


def test_linear_prediction_needs_a_linear_model():
    with pytest.raises(ParameterError, match='no linear model'):
        bicep_model(linear=None).predict(table(), 'linear')
