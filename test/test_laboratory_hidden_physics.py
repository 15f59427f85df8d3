# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Each effect of the laboratory changes the arm in the way that its physics asks for."""

import math

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.laboratory import EFFECTS, hidden_effects, Plant, unlisted_effects
from hysteresis_ros.laboratory.arm import Arm
from hysteresis_ros.laboratory.conditions import Air, Conditions
from hysteresis_ros.laboratory.heat import GAIN, HeatBalance
from hysteresis_ros.laboratory.hidden_physics import apply_effects
from hysteresis_ros.laboratory.linkage import Linkage
from hysteresis_ros.laboratory.parallel_wires import ParallelWires
from hysteresis_ros.laboratory.plant import BRISK
from hysteresis_ros.laboratory.sequences import repeated_loop, steps_of_all_speeds
from hysteresis_ros.laboratory.unlisted import Events
import numpy as np
import pytest

CATALOGUE = (
    'supply_sag pwm_dead_zone resistance_change thermal_lag heating_cooling_asymmetry latent_heat '
    'ambient_temperature ambient_drift airflow stress_dependence stress_dependent_strain r_phase '
    'creep fatigue slack series_compliance unequal_muscles coulomb_friction viscous_friction '
    'inertia payload_error clamp_mass geometry_error frame_tilt end_stop encoder_offset backlash '
    'latency cable_friction encoder_eccentricity measured_supply heat_loss wire_break '
    'overload formation_memory cold_clamps supply_limit encoder_scale').split()
MIDDLE = 4.1


def degrees(effects, voltages, seed=0, **options):
    """Return the settled angles [deg] of an arm with some effects."""
    return np.degrees(Plant(seed, effects, **options).arm_trial(voltages)['angle'])


def shift(name, voltages, strength=1.0):
    """Return by how much an effect moves the settled arm [deg]."""
    return degrees({name: strength}, voltages) - degrees({}, voltages)


def calm(**values):
    """Return an arm in still air that follows at once."""
    return Arm(Conditions(air=Air(turbulence=0.0), heat=HeatBalance(time_constant=BRISK),
                          **values))


def run(arm, voltages, dt=0.1):
    """Return the measured angles of an arm [rad], shape (n,)."""
    angles = []
    for voltage in voltages:
        arm.advance(dt, voltage)
        angles.append(arm.measured_angle)
    return np.array(angles)


def test_registry():
    """All of the catalogue, and at least eight that it lacks."""
    assert sorted(hidden_effects()) == sorted(CATALOGUE)
    assert len(unlisted_effects()) >= 8
    assert all(name.startswith('unlisted_') for name in unlisted_effects())
    assert set(EFFECTS) == {*hidden_effects(), *unlisted_effects(), 'thermal_expansion'}
    assert all(effect.sentence.endswith('.') for effect in EFFECTS.values())


@pytest.mark.parametrize('name', ['supply_sag', 'pwm_dead_zone', 'airflow', 'payload_error',
                                  'resistance_change', 'stress_dependence', 'clamp_mass'])
def test_effects_that_lower_the_arm(name):
    """Less heat, or more weight, lets the arm hang lower; a weak effect does so less."""
    strong, weak = shift(name, [MIDDLE]), shift(name, [MIDDLE], 0.4)
    assert strong > 2.0 * weak > 0.08


@pytest.mark.parametrize('name', ['slack', 'series_compliance'])
def test_effects_that_lengthen_the_wires(name):
    """They lower the arm wherever it stands."""
    assert np.all(shift(name, [1.0, MIDDLE, 6.0]) > 4.0)


@pytest.mark.parametrize('name', ['airflow', 'payload_error', 'stress_dependence', 'frame_tilt',
                                  'geometry_error', 'encoder_offset', 'stress_dependent_strain'])
def test_signed_effects_turn_round(name):
    """A negative strength has the opposite effect."""
    assert shift(name, [MIDDLE])[0] * shift(name, [MIDDLE], -1.0)[0] < 0.0


def test_supply_sag_is_ohms_law():
    """Board and wire share the voltage as their resistances."""
    conditions = Conditions(lead_resistance=2.0)
    assert conditions.drive_squared(5.0, 0.3) == pytest.approx(16.0)


def test_dead_zone():
    """Nothing below it, all of the range above it."""
    conditions = Conditions(dead_voltage=1.0)
    assert conditions.drive_squared(1.0, 0.0) == 0.0
    assert conditions.drive_squared(6.0, 0.0) == pytest.approx(36.0)
    assert conditions.drive_squared(3.5, 0.0) == pytest.approx(9.0)


def test_limited_current():
    """As much heat as is asked for below the limit; above it, more in the phase that resists."""
    conditions = Conditions(largest_current=0.5, resistance_growth=0.25)
    assert conditions.drive_squared(4.0, 0.0) == pytest.approx(16.0)
    assert conditions.drive_squared(6.0, 0.0) == pytest.approx(16.0)
    assert conditions.drive_squared(6.0, 1.0) == pytest.approx(20.0)


def test_resistance_depends_on_the_phase():
    """The more resistance the martensite has, the less the same voltage heats it."""
    conditions = Conditions(resistance_growth=0.25)
    assert conditions.drive_squared(4.0, 1.0) == pytest.approx(16.0 / 1.25)
    assert conditions.drive_squared(4.0, 0.0) == pytest.approx(16.0)
    strong = shift('resistance_change', [6.0, MIDDLE])
    assert abs(strong[0]) < 0.2 < abs(strong[1])


def time_to(effects, start, end, share=0.9):
    """Return how long the temperature takes for most of the way to a new voltage [s]."""
    arm = Plant(0, effects, heat_time_constant=BRISK).arm
    arm.conditions.air.turbulence = 0.0
    arm.settle(300.0, start)
    first = arm.temperature
    last = 22.0 + GAIN * end ** 2
    for count in range(1, 4000):
        arm.advance(0.05, end)
        if abs(arm.temperature - first) > share * abs(last - first):
            return 0.05 * count
    raise AssertionError('it takes too long')


def test_thermal_lag_takes_seconds():
    """90 % of the way take 2.3 time constants."""
    assert time_to({}, 1.0, 4.0) < 0.6
    conditions = apply_effects(Conditions(), {'thermal_lag': 1.0}, 0)
    expected = math.log(10.0) * conditions.heat.time_constant
    assert time_to({'thermal_lag': 1.0}, 1.0, 4.0) == pytest.approx(expected, abs=0.1)
    assert 4.0 < conditions.heat.time_constant < 8.0


def test_heating_is_faster_than_cooling():
    """With the asymmetry; the balance itself is the same from both sides."""
    name = {'heating_cooling_asymmetry': 1.0}
    assert time_to(name, 4.0, 1.0) > 1.5 * time_to(name, 1.0, 4.0)
    assert abs(shift('heating_cooling_asymmetry', [6.0])[0]) < 0.1


def test_latent_heat_slows_the_transformation_only():
    """The way through the transformation takes longer than that through the cold."""
    plain, heat = math.log(10.0) * 2.0, {'latent_heat': 1.0}
    assert time_to(heat, 0.0, 1.5) == pytest.approx(plain, abs=0.1)
    assert time_to(heat, 2.8, 4.6) > 1.5 * plain


def test_ambient_temperature_is_recorded_and_felt():
    """A warm room raises the arm, and the thermometer says so."""
    plant = Plant(0, {'ambient_temperature': 1.0}, recording_time=1800.0)
    table = plant.arm_trial(np.full(60, MIDDLE))
    warm, angle = table['ambient_temperature'], np.degrees(table['angle'])
    assert np.ptp(warm) > 12.0
    assert np.corrcoef(warm, angle)[0, 1] < -0.6


def test_ambient_drift_is_felt_but_not_recorded():
    """The arm rises in the course of the recording; the thermometer stands still."""
    plant = Plant(0, {'ambient_drift': 1.0}, recording_time=1800.0)
    table = plant.arm_trial(np.full(60, MIDDLE))
    assert np.ptp(table['ambient_temperature']) < 0.4
    assert table['angle'][-1] < table['angle'][0] - 0.1


def test_airflow_changes_gain_and_time_constant():
    """More air: cooler, and faster."""
    heat = HeatBalance(airflow=2.0)
    assert heat.balance(16.0, 22.0) == pytest.approx(22.0 + GAIN * 8.0)
    assert heat.advance(100.0, 22.0, 2.5) == pytest.approx(
        HeatBalance(time_constant=2.5).advance(100.0, 22.0, 2.5))


def test_stress_dependence_acts_on_the_bench():
    """A smaller C moves the loop of a heavy load to higher voltages."""
    up = np.linspace(0.0, 6.0, 61)
    lengths = [Plant(0, effects).length_trial(up, 7.056) for effects in
               ({}, {'stress_dependence': 1.0})]
    middle = [up[length < length.mean()][0] for length in lengths]
    assert middle[1] > middle[0] + 0.2


def test_stress_dependent_strain_acts_on_the_bench():
    """A heavy load is longer when cold, and as long as before when hot."""
    lengths = [Plant(0, effects).length_trial([0.0, 6.0], 7.056) for effects in
               ({}, {'stress_dependent_strain': 1.0})]
    assert lengths[1][0] > lengths[0][0] + 1e-3
    assert lengths[1][1] == pytest.approx(lengths[0][1], abs=6e-4)


def test_effects_of_the_arm_leave_the_bench_alone():
    """The bench was measured before anything went wrong with the arm."""
    for name, effect in EFFECTS.items():
        same = np.array_equal(Plant(1, {name: 1.0}).length_trial([3.0, 4.2, 3.0, 6.0], 3.136),
                              Plant(1).length_trial([3.0, 4.2, 3.0, 6.0], 3.136))
        # Under a weight that hangs still martensite keeps what it would have anyway.
        assert same != (effect.bench and name != 'formation_memory'), name


def test_r_phase_is_a_narrow_early_step():
    """It shortens the hot wire, not the cold one, and its own loop is a few kelvin wide."""
    difference = shift('r_phase', [1.0, 6.0])
    assert abs(difference[0]) < 0.3 and difference[1] < -4.0


def test_creep_follows_the_logarithm_of_time():
    """After a step the arm goes on the same way, as much from 10 s to 30 s as from 30 s to 90 s."""
    arm = calm(creep=0.004)
    angles = run(arm, np.full(3000, 4.2))
    early, late = angles[300] - angles[100], angles[900] - angles[300]
    assert early < -0.015
    assert late == pytest.approx(early, rel=0.25)
    up = run(arm, np.full(900, 3.4))
    assert up[-1] > up[100] + 0.015


def test_creep_of_a_full_transformation():
    """After 57 s it is the share c of the length times ln(1 + 57 / 3), as the wires contract."""
    conditions = Conditions(creep=0.004, creep_time=3.0)
    muscle = ParallelWires(conditions)
    muscle.age(6.0, 0.1)
    muscle.commit(120.0, [3.0])
    muscle.age(6.0, 57.0)
    assert muscle.wires[0].excess == pytest.approx(-0.004 * 0.27 * math.log(20.0), rel=1e-3)


def test_fatigue_counts_cycles():
    """Repeated loops drift; without cycles nothing does."""
    arm = calm(shrinkage=0.0025, tiring=0.02)
    for _ in range(10):
        arm.settle(30.0, 6.0)
        arm.settle(30.0, 0.0)
    assert arm.muscle.cycles == pytest.approx(10.0, abs=0.2)
    tired = arm.angle
    arm.heat_and_cool()
    assert arm.angle == pytest.approx(tired, abs=0.02)
    assert tired < calm().angle - 0.08
    assert Plant(0, {'fatigue': 1.0}).arm.muscle.cycles == 0.0


def test_training_gains_stroke_cycle_by_cycle():
    """The wire gets longer when cold, and by more than that of its stroke."""
    arm = Plant(0, {'fatigue': -1.0}).arm
    strokes, cold = [], []
    for _ in range(10):
        arm.settle(30.0, 6.0)
        hot = arm.angle
        arm.settle(30.0, 0.0)
        strokes.append(arm.angle - hot)
        cold.append(arm.angle)
    assert cold[-1] > cold[0] + 0.03 and strokes[-1] > strokes[0] + 0.02


def test_unequal_wires_share_the_load():
    """The shortest pulls most; together they hold the weight."""
    arm = calm(wire_offsets=(-0.003, 0.0, 0.003))
    arm.settle(60.0, 4.0)
    linkage = Linkage()
    assert arm.tensions[0] > arm.tensions[1] > arm.tensions[2] >= 0.0
    assert sum(arm.tensions) * linkage.moment_arm(arm.angle) == pytest.approx(
        linkage.moment(arm.angle), rel=1e-3)


def test_coulomb_friction_sticks_and_drags():
    """Small reversals do not move the arm; going up it lags below, going down above."""
    plain, rubbing = calm(), calm(coulomb=0.08)
    for voltage in (3.0, 3.8, 4.3):
        plain.settle(30.0, voltage)
        rubbing.settle(30.0, voltage)
    assert rubbing.angle > plain.angle + 0.02
    stuck = rubbing.angle
    rubbing.settle(30.0, 4.28)
    assert rubbing.angle == stuck
    for voltage in (6.0, 4.3, 3.9):
        plain.settle(30.0, voltage)
        rubbing.settle(30.0, voltage)
    assert rubbing.angle < plain.angle - 0.02


def test_friction_never_exceeds_its_moment():
    """What the wires miss of the weight's moment, friction holds."""
    arm, linkage = calm(coulomb=0.05), Linkage()
    for voltage in (3.9, 4.0, 4.5, 4.45, 4.2, 4.0, 3.6):
        arm.settle(30.0, voltage)
        gap = linkage.moment(arm.angle) - 3.0 * arm.tensions[0] * linkage.moment_arm(arm.angle)
        assert abs(gap) <= 0.05 + 1e-6


def test_viscous_friction_slows_the_arm():
    """It takes longer to where it settles in the end."""
    step = np.full(150, 4.3)
    quick, slow = run(calm(), step), run(calm(viscous=2.5), step)
    assert slow[10] > quick[10] + 0.1
    assert slow[-1] == pytest.approx(quick[-1], abs=0.06)


def test_a_cooled_wire_hangs_loose_instead_of_pushing_a_slow_arm():
    """Then only the weight moves it, against the friction."""
    arm, linkage = calm(viscous=2.5), Linkage()
    hot = run(arm, np.full(100, 6.0))
    angles = np.concatenate((hot[-1:], run(arm, np.zeros(20))))
    speeds = np.diff(angles) / 0.1
    assert np.all(speeds > 0.0)
    assert np.all(speeds <= max(map(linkage.moment, angles)) / 2.5 + 0.01)


def test_inertia_rings():
    """After a step the arm swings through, at the pulsation of its spring and mass."""
    arm = calm(inertia=0.03)
    run(arm, np.full(100, 4.2))
    angles = run(arm, np.full(150, 6.0), dt=0.02)
    assert angles.min() < angles[-1] - 0.01
    late = angles[20:] - np.mean(angles[20:])
    crossings = np.count_nonzero(np.diff(np.sign(late)))
    assert 1.0 < crossings / 2.0 / 2.6 < 4.0


def test_inertia_settles_where_a_massless_arm_does():
    """In the end only the weight counts."""
    heavy, light = calm(inertia=0.012), calm()
    voltages = np.concatenate((np.linspace(0.0, 4.2, 300), np.full(100, 4.2)))
    assert run(heavy, voltages)[-1] == pytest.approx(run(light, voltages)[-1], abs=0.02)


def test_end_stop_ends_the_range():
    """The arm hardly passes it at either end, and is free elsewhere."""
    assert degrees({'end_stop': 1.0}, [0.0])[0] < 133.0
    assert abs(shift('end_stop', [6.0])[0]) < 0.2
    assert degrees({'end_stop': -1.0}, [6.0])[0] > 103.0
    assert abs(shift('end_stop', [0.0], -1.0)[0]) < 0.2


def test_encoder_offset_is_constant():
    """The same angle is added everywhere."""
    offset = shift('encoder_offset', [0.0, 3.9, MIDDLE, 6.0])
    assert np.ptp(offset) < 0.1 and offset[0] > 6.0


@pytest.mark.parametrize('used', [0.0, 1.0])
def test_backlash_is_a_play(used):
    """
    After a reversal the reading stands still for the width of the play, then follows.

    Zeroed after the arm has come down by itself, it does so from the first turn on.
    """
    arm = calm(backlash=0.1, backlash_used=used)
    assert arm.measured_angle == arm.angle
    true, read = [], []
    for voltage in np.concatenate((np.linspace(0.0, 6.0, 60), np.linspace(6.0, 0.0, 120))):
        arm.settle(30.0, voltage)
        true.append(arm.angle)
        read.append(arm.measured_angle)
    true, read = np.array(true), np.array(read)
    turn = np.argmin(true)
    assert read[turn] == pytest.approx(true[turn] + 0.05 * (1.0 + used), abs=1e-9)
    inside = true[turn:] < true[turn] + 0.1
    np.testing.assert_allclose(read[turn:][inside], read[turn])
    assert read[-1] == pytest.approx(true[-1] - 0.05 * (1.0 - used), abs=1e-9)


def test_latency_delays_the_reading():
    """What is read now was true a second ago; a settled arm reads true."""
    voltages = np.repeat([3.0, 4.5, 3.2], 40)
    now, late = run(calm(), voltages), run(calm(latency=1.0), voltages)
    np.testing.assert_allclose(late[10:], now[:-10], atol=1e-9)
    arm = calm(latency=1.0)
    arm.settle(30.0, 4.3)
    assert arm.measured_angle == arm.angle


def disturbance(name):
    """Return the strong disturbance of an arm with one unlisted effect."""
    return apply_effects(Conditions(), {name: 1.0}, 0).disturbances[0]


def test_cable_pulls_the_raised_arm_down():
    """Not at all below some angle, and more and more above it."""
    cable = disturbance('unlisted_stiffening_cable')
    moments = [cable.moment(0.0, math.radians(angle)) for angle in (135.0, 115.0, 105.0, 95.0)]
    assert moments[0] == 0.0 < moments[1] < moments[2] < moments[3]
    assert moments[3] - moments[2] > moments[2] - moments[1]


def test_magnet_holds_the_arm():
    """It pulls from either side to one angle."""
    magnet = disturbance('unlisted_magnet')
    assert magnet.moment(0.0, math.radians(108.0)) > 0.01
    assert magnet.moment(0.0, math.radians(126.0)) < -0.01


def test_places_that_heat_or_cut_the_wires_off():
    """A hot surface warms at its angle; a flexed lead gives less to the raised arm."""
    hot, lead = disturbance('unlisted_hot_surface'), disturbance('unlisted_flexed_lead')
    warmth = [hot.warmth(0.0, math.radians(angle)) for angle in (95.0, 117.0, 140.0)]
    assert warmth[1] > 10.0 > 1.0 > max(warmth[0], warmth[2]) >= 0.0
    contact = [lead.contact(0.0, math.radians(angle)) for angle in (95.0, 140.0)]
    assert 0.75 < contact[0] < 0.9 < 0.99 < contact[1] <= 1.0


def test_events_come_as_often_as_asked():
    """About twelve jumps in a recording, none before it began."""
    counts = [Events(12.0, 900.0, np.random.default_rng(seed)).passed(900.0)
              for seed in range(60)]
    assert np.mean(counts) == pytest.approx(12.0, abs=1.0)
    events = Events(3.0, 900.0, np.random.default_rng(1))
    assert events.since(0.0) == math.inf
    assert events.since(events.times[1] + 2.0) == pytest.approx(2.0)


@pytest.fixture(scope='module')
def clean():
    """Return a drive and the clean arm's answer to it [deg]."""
    rng = np.random.default_rng(5)
    voltages = np.concatenate((steps_of_all_speeds(rng, 120.0), repeated_loop(rng, 4)))
    return voltages, answer(voltages, {})


def answer(voltages, effects):
    """Return the angles of a continuous run [deg]."""
    time = 0.1 * np.arange(1, len(voltages) + 1)
    plant = Plant(0, effects, heat_time_constant=BRISK, recording_time=time[-1])
    return np.degrees(plant.arm_run(time, voltages)['angle'])


@pytest.mark.parametrize('name', [name for name in EFFECTS if name != 'clamp_mass'])
def test_strong_effects_are_seen_at_once(name, clean):
    """Each moves the arm by more than a degree and a half, most by much more, or all it can."""
    voltages, plain = clean
    difference = answer(voltages, {name: 1.0}) - plain
    least = {'formation_memory': 0.5, 'thermal_expansion': 0.4}.get(name, 1.5)
    assert np.sqrt(np.mean(difference ** 2)) > least
    assert np.all(np.isfinite(difference))


def test_effects_compose():
    """Pairs, and all of them together, still make an arm."""
    voltages = np.linspace(2.5, 5.5, 60)
    for pair in (('inertia', 'coulomb_friction'), ('unequal_muscles', 'end_stop'),
                 ('latent_heat', 'creep'), ('thermal_lag', 'backlash')):
        assert np.ptp(answer(voltages, dict.fromkeys(pair, 0.4))) > 3.0
    everything = answer(voltages, dict.fromkeys(EFFECTS, 0.4))
    assert np.all(np.isfinite(everything))


def test_strength_scales_and_zero_is_nothing():
    """No strength, no effect; specimens differ in the size by a sixth at most."""
    assert np.array_equal(degrees({'encoder_offset': 0.0}, [4.0]), degrees({}, [4.0]))
    sizes = [degrees({'encoder_offset': 1.0}, [1.0], seed=s)[0] - degrees({}, [1.0], seed=s)[0]
             for s in range(8)]
    assert 0.8 < min(sizes) / 9.0 < max(sizes) / 9.0 < 1.2
    assert np.ptp(sizes) > 0.3


def test_random_moments_belong_to_the_recording():
    """The same recording has them again, another one at other times."""
    voltages = np.full(600, 4.0)

    def jumps(recording):
        plant = Plant(0, {'unlisted_skipping_encoder': 1.0}, heat_time_constant=BRISK,
                      recording=recording, recording_time=60.0)
        angle = plant.arm_run(0.1 * np.arange(1, 601), voltages)['angle']
        return np.flatnonzero(np.abs(np.diff(angle[20:])) > 0.02)
    assert len(jumps(0)) >= 4
    assert np.array_equal(jumps(0), jumps(0))
    assert not np.array_equal(jumps(0), jumps(1))


def test_unknown_effects_are_refused():
    """The message lists those that exist."""
    with pytest.raises(ParameterError, match='thermal_lag'):
        apply_effects(Conditions(), {'magic': 1.0}, 0)
