# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects that begin in the middle of a trial: what is handed over, and what is named."""

import numpy as np
import pytest

from hysteresis_ros.bicep.yielding import YieldingBalance
from hysteresis_ros.diagnosis.arm_problem import ArmProblem
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.discrepancy import Offset
from hysteresis_ros.diagnosis.extend import extend
from hysteresis_ros.effects import Inputs
from hysteresis_ros.errors import MeasurementError
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model import Simulator
from hysteresis_ros.model.chain import Chain
from hysteresis_ros.model.trials import trials_of
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage

MODEL = bicep_model()
ROWS, BEFORE = 40, 17
# What the model in use may have: something that remembers at each stage.
IN_USE = ('thermal_lag', 'r_phase', 'fatigue', 'coulomb_friction', 'backlash')


def effects_of(names):
    """Return effects with the strengths of the tests."""
    return [effect_of(MODEL, name) for name in names]


def run_with_onset(dt=4.0, rows=ROWS, before=BEFORE, **columns):
    """Return an arm run with some rows before the onset."""
    marked = np.where(np.arange(rows) < before, 1.0, 0.0)
    columns = {'ambient_temperature': 25.0 + 0.2 * np.arange(rows),
               'supply_voltage': 12.0 - 0.05 * np.arange(rows), **columns}
    return arm_run(wandering_voltage(rows, 5), dt, before_onset=marked, history=marked, **columns)


def simulated(run, in_use, begun, model=MODEL):
    """Return the angles (rows,) with effects that begin at the onset."""
    return Simulator(model, run, before=in_use).run([*in_use, *begun])


def by_hand(run, in_use, begun):
    """
    Return the same row by row, with effects that begin and have no past of their own.

    Two arms in turn, of which the second goes on where the first one stood.
    """
    trial = trials_of(MODEL, run)[0]
    chains = [Chain(effects, MODEL.surroundings) for effects in (in_use, [*in_use, *begun])]
    arms = [MODEL.lifting(chain) for chain in chains]
    stage = MODEL.first_stage(chains[0])
    rest = arms[0].settle(stage.step(0.0))
    for effect in chains[0].sensor:
        effect.begin(rest)
    angles, now = [], 0
    for row, drive in enumerate(trial.drive.tolist()):
        inputs = Inputs(*(float(column[row]) for column in trial.inputs))
        if row == BEFORE:
            now = 1
            memories = {effect.id: effect.save() for effect in chains[0]._all()}
            for effect in chains[1]._all():
                if effect.id in memories:
                    effect.restore(memories[effect.id])
            hand_over(*arms)
        chain, arm = chains[now], arms[now]
        drive_squared = chain.step(drive, inputs)
        offset, factor = chain.advance(drive, drive_squared, inputs)
        angle = arm.step(stage.step(drive_squared), inputs.dt, offset, factor, inputs.clock)
        for effect in chain.sensor:
            angle = effect.step(angle, inputs.dt)
        angles.append(angle)
    return np.array(angles)


def hand_over(arm, other):
    """Give each muscle of another arm the memory that those of an arm have."""
    inner = other._arm if isinstance(other, YieldingBalance) else other
    memories, motion, muscles = arm.snapshot()
    count = len(inner.operators)
    muscles = np.repeat(arm.muscles, count, axis=0) if count > 1 else muscles
    inner.rewind((memories * count, motion, muscles))


@pytest.mark.parametrize('in_use', [(), IN_USE])
@pytest.mark.parametrize('begun', [
    'supply_sag', 'measured_supply', 'pwm_dead_zone', 'airflow', 'ambient_temperature',
    'ambient_drift', 'stress_dependent_strain', 'series_compliance', 'slack', 'unequal_muscles',
    'overload', 'cable_friction', 'frame_tilt', 'payload_error', 'clamp_mass', 'geometry_error',
    'end_stop', 'encoder_offset', 'encoder_eccentricity', 'encoder_scale'])
def test_what_is_remembered_is_handed_over(in_use, begun):
    """By hand, two arms in turn give the same."""
    run, in_use, begun = run_with_onset(), effects_of(in_use), effects_of([begun])
    found = simulated(run, in_use, begun)
    np.testing.assert_allclose(found, by_hand(run, in_use, begun), rtol=0.0, atol=1e-9)
    # The arm that has always had them is elsewhere, and so is the one that never does.
    always, never = (Simulator(MODEL, run).run([*in_use, *effects]) for effects in (begun, []))
    assert np.max(np.abs(found - never)[BEFORE:]) > 1e-4
    assert np.max(np.abs(found - always)[:BEFORE]) > 1e-4


def test_wires_with_other_weights_have_been_through_the_same():
    """As ends that stay cold have been from the beginning, though they count from the onset on."""
    run, begun = run_with_onset(), effects_of(['cold_clamps'])
    stage = MODEL.require_length_stage(Chain(begun, MODEL.surroundings))
    assert len(stage.nodes) > len(MODEL.require_length_stage().nodes)
    inputs = []
    plain = Simulator(MODEL, run).run([], inputs)
    found = simulated(run, [], begun)
    np.testing.assert_array_equal(found[:BEFORE], plain[:BEFORE])
    # An arm with cold ends whose H2 has had the inputs of the other arm.
    arm = MODEL.lifting(Chain(begun, MODEL.surroundings))
    first = MODEL.first_stage(Chain([], MODEL.surroundings))
    arm.settle(first.step(0.0))
    arm.operators[0].simulate(inputs[0][:BEFORE])
    x = first.simulate(run.column('voltage') ** 2)
    angles = [arm.step(value, 4.0) for value in x[BEFORE:].tolist()]
    # What corners do not tell is how far beyond the range of H2 the input has been.
    np.testing.assert_allclose(found[BEFORE:], angles, rtol=0.0, atol=1e-4)
    assert np.max(np.abs(found - plain)) > 0.03


@pytest.mark.parametrize('name', sorted(set(STRENGTHS) - {'valve_lag'}))
def test_nothing_that_begins_acts_before(name):
    """And the arm of the model in use goes on as if there had been no onset."""
    moving = MODEL.with_effects(effects_of([name])).chain().moves
    run = run_with_onset(0.2 if moving or name == 'latency' else 4.0)
    plain = Simulator(MODEL, run)
    begun = simulated(run, [], effects_of([name]))
    np.testing.assert_allclose(begun[:BEFORE], plain.run([])[:BEFORE], rtol=0.0, atol=1e-9)
    assert np.all(np.isfinite(begun))
    in_use = effects_of([name])
    needs_phase = any(effect.needs_phase for effect in in_use)
    np.testing.assert_allclose(
        Simulator(MODEL, run, before=in_use).run(in_use, exact=needs_phase),
        plain.run(in_use, exact=needs_phase), rtol=0.0, atol=1e-5 if needs_phase else 1e-9)


def test_play_is_centred_where_it_begins():
    run, play, begin = run_with_onset(before=9), effect_of(MODEL, 'backlash', B=8.0), 9
    true = Simulator(MODEL, run).run([])
    assert abs(true[begin] - true[begin - 1]) > 0.02
    expected, encoder, half = true.copy(), true[begin - 1], 0.5 * np.radians(play.B)
    for row in range(begin, ROWS):
        encoder = expected[row] = min(max(encoder, true[row] - half), true[row] + half)
    np.testing.assert_allclose(simulated(run, [], [play]), expected, rtol=0.0, atol=1e-9)


def test_what_is_late_from_now_on_was_not_before():
    run, delay = run_with_onset(0.2, before=9), effects_of(['latency'])
    true, found = Simulator(MODEL, run).run([]), simulated(run, [], delay)
    np.testing.assert_array_equal(found[:9], true[:9])
    assert found[9] == true[8] and true[8] != true[9]
    np.testing.assert_allclose(found[10:], 0.75 * true[8:-2] + 0.25 * true[9:-1], atol=1e-9)


def drive_squared(run, in_use, begun):
    """Return the drive squared (rows,) with effects that begin, and in use before."""
    simulator = Simulator(MODEL, run, before=in_use)
    effects = [*in_use, *begun]
    return [simulator.drive_squared(Chain(effects, MODEL.surroundings), simulator.trials[0], past)
            for effects, past in ((effects, simulator.past(effects)), (in_use, None))]


def test_a_lag_begins_at_the_heat_that_is_there():
    """Not in the cold, and not as if what begins with it had acted before."""
    run = run_with_onset(0.2)
    lag, air = effects_of(['thermal_lag'])[0], effect_of(MODEL, 'airflow', beta=0.8)
    found, before = drive_squared(run, [], [lag, air])
    expected, q, decay = before.copy(), before[BEFORE - 1], np.exp(-0.8 * 0.2 / lag.time_constant)
    for row in range(BEFORE, ROWS):
        q = expected[row] = before[row] / 0.8 + (q - before[row] / 0.8) * decay
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize('begun', ['heating_cooling_asymmetry', 'airflow'])
def test_a_lag_goes_on_at_another_rate(begun):
    """Another one that takes its place does so, too."""
    run, (lag, change) = run_with_onset(0.2), effects_of(['thermal_lag', begun])
    found, before = drive_squared(run, [lag], [change])
    beta = change.beta if begun == 'airflow' else 1.0
    volts, expected, q = run.columns['voltage'], before.copy(), before[BEFORE - 1]
    for row in range(BEFORE, ROWS):
        target = volts[row] ** 2 / beta
        rate = change.rate(target > q) if begun != 'airflow' else beta / lag.time_constant
        q = expected[row] = target + (q - target) * np.exp(-0.2 * rate)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_an_error_of_the_model_acts_before_the_onset_too():
    """Unlike an effect of the same size: that is how the angle follows it."""
    run, offset = run_with_onset(), Offset(size=2e-4)
    always = Simulator(MODEL, run).run([offset])
    np.testing.assert_allclose(simulated(run, [], [offset]), always, rtol=0.0, atol=1e-9)
    assert np.all(np.abs(always - Simulator(MODEL, run).run([]))[:BEFORE] > 1e-6)


def test_sets_of_effects_do_not_depend_on_each_other():
    """The arm before the onset is simulated once for all, and stays as it is."""
    run = run_with_onset()
    sets = [effects_of(names) for names in (['airflow'], ['payload_error'], ['overload'], [],
                                            ['wire_break'], ['airflow'])]
    simulator = Simulator(MODEL, run, before=[])
    found = simulator.run_many(sets)
    for effects, angles in zip(sets, found):
        np.testing.assert_array_equal(angles, simulated(run, [], effects))


def test_the_column_does_not_count_where_there_is_no_onset():
    """A prediction is that of the arm with all effects of the model."""
    run = run_with_onset()
    model = MODEL.with_effects(effects_of(['airflow']))
    columns = {name: run.columns[name] for name in run.columns if name != 'before_onset'}
    np.testing.assert_array_equal(
        model.predict(run), model.predict(Measurement.from_columns(columns)))


@pytest.mark.parametrize('marked, trials', [
    ([0, 1, 1, 0], [0, 0, 0, 0]), ([1, 1, 1, 1], [0, 0, 0, 0]), ([1, 0, 0, 0], [0, 0, 1, 1])])
def test_rows_before_the_onset_are_the_first_of_one_trial(marked, trials):
    run = arm_run(np.full(4, 3.0), before_onset=marked, trial=trials)
    with pytest.raises(MeasurementError, match="the column 'before_onset'"):
        ArmProblem(MODEL, [run])


@pytest.mark.long
def test_an_effect_that_begins_with_the_window_is_named():
    """Where it counts as having acted before, the memory is another, and it is not."""
    rng = np.random.default_rng(5)
    voltage = np.concatenate(([5.6, 2.0, 5.2, 2.4], np.linspace(2.6, 4.9, 9),
                              np.linspace(4.7, 2.8, 8)))
    marked = np.where(np.arange(len(voltage)) < 4, 1.0, 0.0)
    columns = {'before_onset': marked, 'history': marked}
    effect = effect_of(MODEL, 'airflow', beta=0.75)
    run = arm_run(voltage, **columns)
    angle = simulated(run, [], [effect]) + 5e-4 * rng.standard_normal(len(voltage))
    measured = arm_run(voltage, angle=angle, **columns)
    found = diagnose(MODEL, [measured])
    assert found.missing == ['airflow']
    assert found.effects[0].beta == pytest.approx(0.75, abs=0.02)
    # The error of the extended model is that of the arm before and after, too.
    assert extend(MODEL, ['airflow'], [measured]).train['rmse_after'] < 1e-3
    del columns['before_onset']
    assert 'airflow' not in diagnose(MODEL, [arm_run(voltage, angle=angle, **columns)]).missing
