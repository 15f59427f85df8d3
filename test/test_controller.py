# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The controller: its voltages bring the model's own arm to the target, and its memory follows."""

import dataclasses
import json
import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from hysteresis_ros.effects import catalogue
from hysteresis_ros.errors import ParameterError, RangeError
from hysteresis_ros.model import MuscleModel, Simulator
from hysteresis_ros.share import share_path
from model_support import arm_run, bicep_model, effect_of, GEOMETRY

TARGETS = np.radians(np.random.default_rng(3).uniform(82.0, 106.0, 20)).tolist()
# Within reach with all effects at once, too.
SOME = [1.75 + 0.3 * (target - 1.64) for target in TARGETS]
INVERTIBLE = [name for name, effect in catalogue().items() if effect.invertible]
LAGS = ('thermal_lag', 'heating_cooling_asymmetry', 'heat_loss', 'valve_lag')
# Their phase has to come into agreement first.
PHASE = ('resistance_change', 'latent_heat')
MANY = ('supply_sag', 'pwm_dead_zone', 'airflow', 'ambient_temperature', 'stress_dependence',
        'series_compliance', 'stress_dependent_strain', 'r_phase', 'fatigue', 'slack',
        'unequal_muscles', 'coulomb_friction', 'frame_tilt', 'payload_error', 'clamp_mass',
        'geometry_error', 'backlash', 'encoder_offset')


def drive_arm(model, targets=TARGETS, repeats=1, **options):
    """Hold each target for settled samples; return the angles reached and the setpoints."""
    controller, observer = model.controller(**options), model.observer()
    # A first hold, too, lasts 30 s.
    observer.reset(-30.0)
    angles, setpoints = [], []
    for n, target in enumerate(targets):
        setpoints.append(controller.setpoint(*controller.reference(target), ambient=28.0))
        for k in range(repeats):
            angle = observer.step(30.0 * (n * repeats + k), setpoints[-1].voltage, 28.0)
        angles.append(angle)
    return np.array(angles), setpoints


def test_every_effect_that_can_be_undone_is_here():
    assert set(catalogue()) - set(INVERTIBLE) == {
        'ambient_drift', 'viscoelastic_creep', 'viscous_friction', 'inertia', 'end_stop',
        'wire_break', 'overload', 'latency'}


@pytest.mark.parametrize('names', [(), *((name,) for name in INVERTIBLE if name not in PHASE),
                                   MANY, (*MANY, 'formation_memory')])
def test_the_models_own_arm_reaches_every_target(names):
    # A lag has settled after a long hold.
    repeats = 10 if set(names) & set(LAGS) else 1
    targets = SOME if len(names) > 1 else TARGETS
    angles, setpoints = drive_arm(bicep_model(names), targets, repeats)
    assert not any(setpoint.saturated for setpoint in setpoints)
    assert max(abs(setpoint.error) for setpoint in setpoints) < 1e-9
    np.testing.assert_allclose(angles, targets, rtol=0.0, atol=1e-6)


def test_targets_are_reached_while_cycles_move_the_transformation():
    model = bicep_model()
    model = dataclasses.replace(model, effects=[effect_of(model, 'fatigue', b=0.05, c=0.4)])
    angles, setpoints = drive_arm(model)
    assert not any(setpoint.saturated for setpoint in setpoints)
    np.testing.assert_allclose(angles, TARGETS, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize('linear', [0.5, 1.0])
@pytest.mark.parametrize('time_constant', [0.0, 4.0])
def test_targets_are_reached_where_an_arm_loses_heat_otherwise_than_the_bench(
        time_constant, linear):
    """What it loses at rest is undone whether or not it lags."""
    model = bicep_model()
    model = dataclasses.replace(model, effects=[catalogue()['heat_loss'](
        model.surroundings, time_constant=time_constant, growth=0.8, linear=linear)])
    angles, setpoints = drive_arm(model, repeats=10)
    assert not any(setpoint.saturated for setpoint in setpoints)
    np.testing.assert_allclose(angles, TARGETS, rtol=0.0, atol=1e-6)


def test_a_sensor_without_a_memory_needs_no_state_of_rest():
    """Nor the lengths from which that would follow."""
    model = dataclasses.replace(bicep_model(['encoder_offset']), length_stage=None)
    plain = dataclasses.replace(bicep_model(), length_stage=None)
    offset = math.radians(model.effects[0].offset)
    assert model.controller().reference(1.7) == pytest.approx(
        plain.controller().reference(1.7 - offset))


@pytest.mark.parametrize('seat, zeroed', [
    (-1.0, 1.0), (0.5, 1.0), (1.0, 1.0), (-1.0, 0.0), (1.0, 0.0), (-1.0, 2.0), (1.0, 2.0)])
def test_targets_are_reached_wherever_in_its_play_the_encoder_was_zeroed(seat, zeroed):
    model = bicep_model()
    play = effect_of(model, 'backlash', B=3.0, seat=seat, zeroed=zeroed)
    angles, _ = drive_arm(model.with_effects([play]), SOME)
    np.testing.assert_allclose(angles, SOME, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize('names', [*((name,) for name in PHASE),
                                   ('resistance_change', 'series_compliance')])
def test_the_arm_reaches_targets_once_the_phase_agrees(names):
    angles, setpoints = drive_arm(bicep_model(names), repeats=20)
    assert max(abs(setpoint.error) for setpoint in setpoints) < 1e-12
    np.testing.assert_allclose(angles, TARGETS, rtol=0.0, atol=2e-4)


def test_the_simulation_of_the_voltages_reaches_the_targets_too():
    model = bicep_model(MANY)
    _, setpoints = drive_arm(model, SOME)
    voltage = np.array([setpoint.voltage for setpoint in setpoints])
    run = arm_run(voltage, ambient_temperature=np.full(len(voltage), 28.0))
    np.testing.assert_allclose(Simulator(model, run).run(model.effects), SOME, atol=1e-6)


@settings(max_examples=25)
@given(st.lists(st.floats(1.43, 1.85), min_size=1, max_size=8))
def test_any_sequence_within_reach_is_followed(targets):
    angles, _ = drive_arm(bicep_model(), targets)
    np.testing.assert_allclose(angles, targets, rtol=0.0, atol=1e-6)


def test_without_the_inverse_of_an_effect_the_arm_is_off():
    for name in ('supply_sag', 'payload_error', 'coulomb_friction', 'encoder_offset', 'backlash'):
        setpoints = drive_arm(bicep_model())[1]
        observer = bicep_model([name]).observer()
        angles = [observer.step(30.0 * n, s.voltage) for n, s in enumerate(setpoints)]
        assert np.max(np.abs(np.array(angles) - TARGETS)) > math.radians(0.5)


def test_hold_without_a_horizon_repeats_the_setpoint():
    controller = bicep_model(['thermal_lag']).controller()
    assert controller.hold(0.0) == 0.0
    setpoint = controller.setpoint(*controller.reference(1.5), 1.0)
    memory = controller.save()
    assert controller.hold(1.5) == controller.hold(7.0) == setpoint.voltage
    for part in ('first', 'second', 'force'):
        assert controller.save()[part] == memory[part]


def test_hold_leaves_the_memory_of_the_hysteresis_alone():
    controller = bicep_model(['thermal_lag', 'r_phase']).controller(horizon=2.0)
    controller.setpoint(*controller.reference(1.5), 0.0)
    memory = controller.save()
    voltages = {controller.hold(0.5 * n) for n in range(1, 20)}
    assert len(voltages) > 1
    after = controller.save()
    for part in ('first', 'second', 'force', 'targets'):
        assert after[part] == memory[part]
    assert after['effects'][1] == memory['effects'][1]


@pytest.mark.parametrize('names', [(), ('thermal_lag', 'r_phase', 'unequal_muscles'), MANY])
def test_a_setpoint_that_is_not_committed_changes_nothing(names):
    controller = bicep_model(names).controller(horizon=2.0)
    for time, target in enumerate(TARGETS[:4]):
        reference = controller.reference(target)
        before = controller.save()
        asked = controller.setpoint(*reference, 30.0 * time, commit=False)
        controller.setpoint(reference.length - 1e-3, 7.0, 30.0 * time + 3.0, commit=False)
        assert controller.save() == before
        again = controller.setpoint(*reference, 30.0 * time)
        # Where the last search ended says where the next one begins, not what it finds.
        assert again.voltage == pytest.approx(asked.voltage, abs=1e-9)
        assert again.expected == pytest.approx(asked.expected, abs=1e-12)
        assert again.saturated == asked.saturated
        assert controller.save() != before
        force = controller.force_setpoint(5.0 + time, commit=False)
        assert controller.force_setpoint(5.0 + time) == force


def test_memory_follows_each_setpoint_once():
    controller = bicep_model().controller()
    stage, first = bicep_model().require_length_stage(), bicep_model().force_stage
    first.reset()
    cold = bicep_model().observer()
    rest = cold.step(0.0, 0.0)
    stage.step(GEOMETRY.force(rest) - first.step(0.0))
    for target in TARGETS:
        length, force = controller.reference(target)
        setpoint = controller.setpoint(length, force)
        again = controller.setpoint(length, force)
        assert again.voltage == pytest.approx(setpoint.voltage, abs=1e-9)
        assert stage.step(force - first.step(setpoint.voltage)) == pytest.approx(length, abs=1e-9)
        assert setpoint.expected == pytest.approx(length, abs=1e-12)


def test_on_the_bench_the_cold_muscle_bears_the_first_force():
    model = bicep_model()
    controller = model.controller()
    stage, first = model.require_length_stage(), model.force_stage
    first.reset()
    stage.step(4.0 - first.step(0.0))
    for length in (-0.008, -0.012, -0.006):
        setpoint = controller.setpoint(length, 4.0)
        assert stage.step(4.0 - first.step(setpoint.voltage)) == pytest.approx(length, abs=1e-12)


def test_a_separate_node_can_say_that_the_muscle_lifts_the_arm():
    model = bicep_model()
    references = [model.controller().reference(target) for target in TARGETS]
    observer, controller = model.observer(), model.controller(arm=True)
    for n, reference in enumerate(references):
        angle = observer.step(30.0 * n, controller.setpoint(*reference).voltage)
        assert angle == pytest.approx(TARGETS[n], abs=1e-6)


# What goes on over all steps to come has to be turned back at once, through the loop's width.
@pytest.mark.parametrize('kept, largest', [(0.0, 0.1), (1.0, 1.0)])
def test_targets_that_come_again_and_again_keep_a_muscle_that_creeps(kept, largest):
    """At 5 Hz, each held for 10 s: the model's own arm stays, the voltage moves a little."""
    model = bicep_model()
    model = model.with_effects([effect_of(model, 'creep', c=0.3, t0=3.0, kept=kept)])
    time, targets = 0.2 * np.arange(250), np.repeat(np.radians([90, 100, 86, 97, 92]), 50)
    drives, missed = [], []
    for one in (model, bicep_model()):
        controller, observer = one.controller(arm=True), model.observer()
        volts = [controller.setpoint(*controller.reference(target), float(now)).voltage
                 for now, target in zip(time, targets)]
        angles = [observer.step(float(now), volt) for now, volt in zip(time, volts)]
        drives.append(volts)
        missed.append(np.degrees(np.max(np.abs(np.array(angles) - targets))))
    assert missed[0] < 0.01 and missed[1] > 1.0
    held = np.diff(targets) == 0.0
    assert np.max(np.abs(np.diff(drives[0])[held])) < largest


def test_without_times_each_setpoint_is_a_hold_of_thirty_seconds():
    """And a clock that goes back or stands still counts as no time."""
    model = bicep_model(['creep'])
    # The cold muscle creeps little, however long the first hold was.
    targets = [1.94, *TARGETS[:5]]

    def volts(times):
        controller = model.controller(arm=True)
        return [controller.setpoint(*controller.reference(target), now).voltage
                for now, target in zip(times, targets)]
    quiet, timed = volts([None] * 6), volts([0.0, 30.0, 60.0, 90.0, 120.0, 150.0])
    assert quiet[1:] == pytest.approx(timed[1:], abs=5e-3)
    assert volts([7.0 * n for n in range(6)])[3] != pytest.approx(timed[3], abs=0.02)
    assert volts([9.0, 5.0, 9.0, math.nan, 9.0, 8.0])[:3] == volts([9.0] * 6)[:3]


@pytest.mark.parametrize('names', [(), ('thermal_lag', *MANY), ('creep',)])
def test_saved_memory_brings_the_same_future_back(names):
    model = bicep_model(names)
    controller = model.controller(horizon=3.0)
    for n, target in enumerate(TARGETS[:8]):
        controller.setpoint(*controller.reference(target), 30.0 * n, ambient=26.0)
        controller.hold(30.0 * n + 1.0)
    state = json.loads(json.dumps(controller.save()))

    def future(one):
        return [(one.setpoint(*one.reference(target), 300.0 + 30.0 * n),
                 one.hold(301.0 + 30.0 * n)) for n, target in enumerate(TARGETS[8:])]

    expected = future(controller)
    other = model.controller(horizon=3.0)
    other.restore(state)
    assert future(other) == expected
    controller.restore(state)
    assert future(controller) == expected


def test_memory_that_does_not_fit_is_refused_and_changes_nothing():
    controller = bicep_model(['thermal_lag']).controller()
    controller.setpoint(*controller.reference(1.5), 1.0)
    good = controller.save()
    others = [{}, {**good, 'ambient': math.nan}, {**good, 'second': []},
              {**good, 'effects': [[], []]}, {**good, 'first': None}, {**good, 'pacing': {}},
              {**good, 'pacing': {**good['pacing'], 'travel': 'far'}},
              {**good, 'pacing': {**good['pacing'], 'drive': math.inf}},
              {**good, 'targets': {**good['targets'], 'mood': 1.0}},
              {**good, 'targets': {**good['targets'], 'direction': None}},
              {**good, 'targets': {**good['targets'], 'angle': 10 ** 400}},
              bicep_model().controller().save(), None]
    for state in others:
        with pytest.raises(ParameterError, match='saved memory does not fit') as error:
            controller.restore(state)
        assert '\n' not in str(error.value)
        assert controller.save() == good


def test_reset_forgets_all_but_the_wear():
    controller, fresh = (bicep_model(['thermal_lag', 'backlash']).controller() for _ in range(2))
    for n, target in enumerate(TARGETS):
        controller.setpoint(*controller.reference(target), 30.0 * n, ambient=22.0)
    controller.reset()
    references = [fresh.reference(target) for target in TARGETS]
    assert [controller.reference(target) for target in TARGETS] == references
    assert [controller.setpoint(*r) for r in references] == [fresh.setpoint(*r) for r in references]

    worn, fresh = (bicep_model(['fatigue']).controller() for _ in range(2))
    for target in TARGETS:
        worn.setpoint(*worn.reference(target))
    worn.reset()
    reference = fresh.reference(1.6)
    assert worn.setpoint(*reference).voltage < fresh.setpoint(*reference).voltage


@pytest.mark.parametrize('bad', [math.nan, math.inf, -math.inf])
def test_a_reference_that_is_no_number_keeps_the_last_voltage(bad):
    controller = bicep_model(['thermal_lag']).controller(horizon=2.0)
    assert controller.setpoint(bad, 5.0).voltage == 0.0
    last = controller.setpoint(*controller.reference(1.5), 0.0).voltage
    before = controller.save()
    for setpoint in (controller.setpoint(bad, 5.0, 1.0), controller.setpoint(-0.01, bad, 1.0),
                     controller.force_setpoint(bad)):
        assert setpoint.voltage == last
        assert setpoint.saturated and math.isnan(setpoint.expected) and math.isnan(setpoint.error)
        assert setpoint.reason == 'the reference is not a finite number'
    assert controller.save() == before
    with pytest.raises(RangeError):
        controller.reference(bad)
    assert math.isfinite(controller.hold(bad))


def driven(model, targets):
    """Return for targets [deg] what is expected of the muscle [m], what it does, and the miss."""
    controller, observer, found = model.controller(arm=True), model.observer(), []
    for number, target in enumerate(targets, 1):
        point = controller.setpoint(*controller.reference(math.radians(target)), 30.0 * number)
        angle = observer.step(30.0 * number, point.voltage)
        found.append((point.saturated, point.expected, model.geometry.length(angle),
                      math.degrees(angle) - target))
    return found


@pytest.mark.parametrize('names', [(), ('supply_sag',), ('cable_friction',), ('coulomb_friction',),
                                   ('payload_error', 'resistance_change')])
def test_memory_is_right_after_a_target_out_of_reach(names):
    """There the arm rests under another load than that of the target."""
    for far, sign in ((40.0, 1.0), (150.0, -1.0)):
        first, *others = driven(bicep_model(names), [far, 90.0, 95.0, 87.0])
        assert first[0] and sign * first[3] > 20.0
        assert first[1] == pytest.approx(first[2], abs=1e-7)
        assert not any(saturated for saturated, *_ in others)
        assert [miss for *_, miss in others] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)


@pytest.mark.parametrize('name', ['r_phase', 'fatigue', 'creep'])
def test_the_resistance_is_that_of_the_martensite_whatever_else_lengthens_the_muscle(name):
    found = driven(bicep_model(['resistance_change', name]), [92.0, 88.0, 96.0, 90.0])
    assert [miss for *_, miss in found] == pytest.approx([0.0] * 4, abs=1e-3)


def test_what_the_supply_cannot_give_is_said_and_not_taken_for_given():
    model = bicep_model()
    full = model.controller().setpoint(-0.060, 6.0)
    limited = dataclasses.replace(model, effects=[effect_of(model, 'supply_limit', cut=3.5)])
    setpoint = limited.controller().setpoint(full.expected, 6.0)
    assert setpoint.saturated and setpoint.error > 0.001


@pytest.mark.parametrize('names', [(), ('r_phase',), ('unequal_muscles',), ('supply_sag',),
                                   ('resistance_change',)])
@pytest.mark.parametrize('length, voltage', [(-0.06, 5.0), (0.04, 1.0)])
def test_out_of_reach_gives_the_nearest_voltage_and_the_expected_error(names, length, voltage):
    model = bicep_model(names)
    controller = model.controller(voltage_limits=(1.0, 5.0))
    controller.setpoint(-0.010, 6.0)
    setpoint = controller.setpoint(length, 6.0)
    assert setpoint.voltage == voltage
    assert setpoint.saturated
    assert setpoint.error == setpoint.expected - length
    assert abs(setpoint.error) > 0.02
    assert '\n' not in setpoint.reason and '1 to 5 voltage' in setpoint.reason
    # Asked for what it expects, it finds it within reach.
    again = controller.setpoint(setpoint.expected, 6.0)
    assert again.voltage == pytest.approx(voltage, abs=1e-4)
    assert abs(again.error) < 1e-7


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3)), min_size=1, max_size=8),
       st.sampled_from([(), ('r_phase',), ('unequal_muscles',), ('thermal_lag',),
                        ('stress_dependent_strain',)]))
def test_whatever_is_asked_the_voltage_is_finite_and_within_its_limits(references, names):
    controller = bicep_model(names).controller(voltage_limits=(0.5, 5.5), horizon=1.0)
    for n, (length, force) in enumerate(references):
        for setpoint in (controller.setpoint(length, force, 0.5 * n),
                         controller.force_setpoint(force)):
            assert 0.5 <= setpoint.voltage <= 5.5
            assert math.isfinite(setpoint.expected) and math.isfinite(setpoint.error)
        assert 0.5 <= controller.hold(0.5 * n + 0.2) <= 5.5


@pytest.mark.parametrize('limits', [(3.0, 3.0), (5.0, 1.0), (math.nan, 5.0)])
def test_limits_that_leave_nothing_are_refused(limits):
    with pytest.raises(ParameterError, match='drive limits'):
        bicep_model().controller(voltage_limits=limits)


def test_forces_are_reached_at_resting_length():
    for names in ((), ('supply_sag', 'airflow', 'ambient_temperature'), ('resistance_change',)):
        model = bicep_model(names)
        controller = model.controller()
        stage = model.force_stage
        stage.reset()
        chain = model.chain()
        for force in (3.0, 9.0, 5.0, 10.0, 4.0):
            setpoint = controller.force_setpoint(force, ambient=28.0)
            assert not setpoint.saturated and abs(setpoint.error) < 1e-9
            low, high = stage.output_range
            inputs = controller._inputs(0.0, (high - force) / (high - low), 28.0)
            felt = float(chain.to_drive(chain.step(setpoint.voltage, inputs)))
            assert stage.step(felt) == pytest.approx(force, abs=1e-9)


def test_force_out_of_reach_is_flagged():
    controller = bicep_model().controller(voltage_limits=(0.0, 4.0))
    for force in (100.0, 14.0):
        setpoint = controller.force_setpoint(force)
        assert setpoint.voltage == 4.0 and setpoint.saturated
        assert setpoint.error == setpoint.expected - force < 0.0
        assert 'N is outside 0.5 to 14.5 N' in setpoint.reason


@pytest.mark.parametrize('names', [(), ('r_phase',)])
def test_a_dead_band_does_not_follow_small_reversals(names):
    exact = bicep_model(names).controller()
    calm = bicep_model(names).controller(dead_band=1e-4)
    for controller in (exact, calm):
        controller.setpoint(-0.008, 6.0)
        controller.setpoint(-0.010, 6.0)
    last = calm.hold(0.0)
    back = calm.setpoint(-0.010 + 5e-5, 6.0)
    assert back.voltage == pytest.approx(last, abs=1e-9)
    assert back.error == pytest.approx(-5e-5, abs=1e-9)
    assert exact.setpoint(-0.010 + 5e-5, 6.0).voltage < last - 0.01
    assert calm.setpoint(-0.010 + 5e-4, 6.0).error == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize('name', ['coulomb_friction', 'backlash'])
def test_noise_of_a_target_does_not_swing_what_is_undone_by_direction(name):
    rng = np.random.default_rng(1)
    for start, drift in ((1.55, 0.0), (1.45, 2e-3)):
        controller = bicep_model([name]).controller()
        targets = start + drift * np.arange(80) + math.radians(0.01) * rng.uniform(-1.0, 1.0, 80)
        volts = [controller.setpoint(*controller.reference(target)).voltage for target in targets]
        assert np.max(np.abs(np.diff(volts[2:]))) < 0.1
    # A turn by more is one.
    back = controller.setpoint(*controller.reference(targets[-1] - 3e-3)).voltage
    assert abs(back - volts[-1]) > 0.5
    exact = bicep_model([name]).controller(angle_dead_band=0.0)
    volts = [exact.setpoint(*exact.reference(target)).voltage
             for target in (1.55, 1.5502, 1.55, 1.5502)]
    assert np.max(np.abs(np.diff(volts))) > 0.5
    with pytest.raises(ParameterError, match='angle_dead_band is -1'):
        bicep_model([name]).controller(angle_dead_band=-1.0)


@pytest.mark.parametrize('horizon', [math.inf, 2.0])
def test_a_rate_limit_spreads_a_step_over_the_calls_that_follow(horizon):
    model = bicep_model(['thermal_lag'])
    free = model.controller(arm=True)
    controller = model.controller(rate_limit=2.0, horizon=horizon)
    time, volts = 0.0, [0.0]
    for target in (1.5, 1.7):
        reference = controller.reference(target)
        volts.append(controller.setpoint(*reference, time).voltage)
        for _ in range(80):
            time += 0.25
            volts.append(controller.hold(time))
        assert volts[-1] == pytest.approx(free.setpoint(*reference).voltage, abs=1e-3)
    assert np.max(np.abs(np.diff(volts))) == pytest.approx(0.5)
    with pytest.raises(ParameterError, match='rate_limit is 0'):
        controller.rate_limit = 0.0


@pytest.mark.parametrize('name', ['supply_sag', 'unequal_muscles'])
def test_what_is_reached_exactly_is_not_called_saturated(name):
    """The package's model has plateaus, on which a drive beyond the limits gives the same."""
    model = MuscleModel.load(share_path('config/bicep_model.yaml'))
    model = model.with_effects([effect_of(model, name)])
    rng = np.random.default_rng(0)
    controller = model.controller()
    controller.setpoint(-0.008, 3.0)
    drives = np.clip(rng.uniform(-1.0, 7.0, 200), 0.0, 6.0)
    for volts, force in zip(drives.tolist(), rng.uniform(1.0, 8.0, 200).tolist()):
        length = controller._length.outcome(volts, force, controller._inputs(0.0, 0.5)).length
        found = controller.setpoint(length, force)
        assert abs(found.error) < 1e-9
        assert not found.saturated and found.reason == ''


def test_the_cold_arm_is_asked_for_the_angle_at_which_it_hangs():
    model = bicep_model()
    rest = model.observer().step(0.0, 0.0)
    controller = model.controller()
    found = controller.setpoint(*controller.reference(rest))
    assert found.voltage == 0.0 and not found.saturated and abs(found.error) < 1e-8
    assert controller.setpoint(*controller.reference(rest + 1e-3)).saturated


@pytest.mark.parametrize('horizon', [math.inf, 2.0])
def test_a_hold_takes_a_new_ambient_temperature(horizon):
    model = bicep_model(['ambient_temperature', 'thermal_lag'])
    controller = model.controller(horizon=horizon)
    reference = controller.reference(1.6)
    controller.setpoint(*reference, 0.0, ambient=24.0)
    time = 0.0
    for ambient in (24.0, 30.0, 21.0, math.nan):
        for _ in range(300):
            time += 0.1
            volts = controller.hold(time, ambient)
        fresh = model.controller(arm=True).setpoint(
            *reference, ambient=ambient if math.isfinite(ambient) else 21.0)
        assert volts == pytest.approx(fresh.voltage, abs=1e-3)


def test_effects_that_cannot_be_undone_do_no_harm():
    plain = [s.voltage for s in drive_arm(bicep_model())[1]]
    for name in ('ambient_drift', 'viscous_friction', 'inertia', 'latency'):
        controller = bicep_model([name]).controller()
        setpoints = [controller.setpoint(*controller.reference(target)) for target in TARGETS]
        assert [s.voltage for s in setpoints] == pytest.approx(plain, abs=1e-12)
        assert max(abs(s.error) for s in setpoints) < 1e-9


def test_reference_undoes_what_arm_and_sensor_do():
    controller = bicep_model(['encoder_offset', 'payload_error', 'geometry_error']).controller()
    length, force = controller.reference(1.5)
    true = 1.5 - math.radians(2.0)
    built = GEOMETRY.__class__(**{**GEOMETRY.to_mapping(), 'clamp_distance': 0.0176,
                                  'clamp_height': 0.0056, 'anchor_height': 0.2658,
                                  'payload_mass': 0.115})
    assert length == pytest.approx(float(built.length(true)), abs=1e-12)
    assert force == pytest.approx(float(built.force(true)), abs=1e-12)


def test_friction_pulls_against_the_direction_of_the_motion():
    model = bicep_model(['coulomb_friction'])
    controller = model.controller()
    low, high = 1.4, 1.7
    arm = {theta: 0.02 / (3.0 * GEOMETRY.moment_arm(theta)) for theta in (low, high)}
    # The cold arm hangs, so the first motion is upwards: theta falls.
    assert controller.reference(high).force == pytest.approx(GEOMETRY.force(high) + arm[high])
    assert controller.reference(low).force == pytest.approx(GEOMETRY.force(low) + arm[low])
    assert controller.reference(low).force == pytest.approx(GEOMETRY.force(low) + arm[low])
    assert controller.reference(high).force == pytest.approx(GEOMETRY.force(high) - arm[high])


def test_a_target_that_is_refused_is_not_remembered():
    controller = bicep_model(['backlash', 'encoder_offset', 'coulomb_friction']).controller()
    controller.reference(1.5)
    before = controller.save()
    for target in (0.1, 3.2, GEOMETRY.angle_range[0] + math.radians(1.0), math.nan):
        with pytest.raises(RangeError) as error:
            controller.reference(target)
        assert '\n' not in str(error.value)
    assert controller.save() == before


def test_targets_where_no_muscle_can_hold_the_arm_are_refused():
    model = bicep_model()
    stopped = model.with_effects([effect_of(model, 'end_stop')]).controller()
    stopped.reference(1.9)
    with pytest.raises(RangeError, match='would have to push'):
        stopped.reference(2.2)
    bent = model.with_effects([effect_of(model, 'geometry_error', da=20.0, dx=-16.9)])
    with pytest.raises(RangeError, match='beyond a dead centre'):
        bent.controller().reference(1.2)


@pytest.mark.parametrize('changes, call, message', [
    ({'length_stage': None}, lambda c: c.setpoint(-0.01, 5.0), 'no length stage'),
    ({'force_stage': None}, lambda c: c.force_setpoint(5.0), 'no force stage'),
    ({'geometry': None}, lambda c: c.reference(1.5), 'no arm geometry')])
def test_what_the_model_lacks_is_said_in_one_line(changes, call, message):
    with pytest.raises(ParameterError, match=message) as error:
        call(bicep_model(**changes).controller())
    assert '\n' not in str(error.value)


def test_a_model_without_a_first_stage_is_inverted_too():
    model = bicep_model(force_stage=None, load_name=None, mean_load=0.0)
    controller = model.controller()
    stage = model.require_length_stage()
    stage.step(0.0)
    for length in (-0.003, -0.008, -0.004):
        setpoint = controller.setpoint(length, 123.0)
        assert stage.step(-setpoint.voltage) == pytest.approx(setpoint.expected, abs=1e-12)
        assert setpoint.saturated == (abs(setpoint.error) > 1e-9)


def test_clausius_clapeyron_instead_of_the_first_stage_is_inverted_too():
    model = bicep_model()
    model = model.with_effects([effect_of(model, 'stress_dependence', C=0.5, shift=0.1)])
    angles, setpoints = drive_arm(model)
    assert not any(setpoint.saturated for setpoint in setpoints)
    np.testing.assert_allclose(angles, TARGETS, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize('names', [(), ('r_phase',)])
def test_without_a_highest_drive_everything_the_muscle_can_do_is_within_reach(names):
    model = bicep_model(names)
    open_ended = model.controller(voltage_limits=(0.0, math.inf))
    limited = model.controller()
    for length in (-0.008, -0.012, -0.009):
        assert open_ended.setpoint(length, 6.0) == limited.setpoint(length, 6.0)
    assert open_ended.setpoint(-1.0, 6.0).saturated


def test_horizon_can_be_changed_on_the_way():
    controller = bicep_model(['thermal_lag']).controller()
    steady = controller.setpoint(*controller.reference(1.6), 0.0).voltage
    controller.horizon = 3.0
    assert controller.horizon == 3.0
    assert controller.setpoint(*controller.reference(1.6), 0.1).voltage > steady


def test_a_muscle_that_extends_is_inverted_too():
    model = bicep_model(sign=1)
    controller = model.controller()
    stage, first = model.require_length_stage(), model.force_stage
    first.reset()
    stage.step(first.step(0.0) - 3.0)
    for length in (-0.012, -0.004, -0.007):
        setpoint = controller.setpoint(length, 3.0)
        assert not setpoint.saturated
        assert stage.step(first.step(setpoint.voltage) - 3.0) == pytest.approx(length, abs=1e-12)
