# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm's balance against brute force: a search over a fine grid with relays of its own."""

import dataclasses
import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from scipy import integrate, optimize

from hysteresis_ros.bicep.balance import ArmBalance, statics_of
from hysteresis_ros.bicep.bundle import Bundle
from hysteresis_ros.bicep.wires import COMPLIANCE
from hysteresis_ros.effects import MaterialEffect
from hysteresis_ros.effects.base import PAPER
from hysteresis_ros.kernels.formation import LOAD
from hysteresis_ros.operators import Linear
from model_support import bicep_model, effect_of, GEOMETRY

MODEL = bicep_model()
LOW, HIGH = GEOMETRY.angle_range


def balance(*names, **values):
    """Balance of the bicep with effects of these names, or of one name with values."""
    model = MODEL.with_effects([effect_of(MODEL, name, **values) for name in names])
    made = model.balance(model.chain())
    made.settle(0.5)
    return made


class Brute:
    """The same arm, solved by brentq over angles with a second stage of its own."""

    def __init__(self, x, load=GEOMETRY.force, length=GEOMETRY.length):
        self.stage = MODEL.require_length_stage()
        self.load, self.length = load, length
        self.step(x)

    def step(self, x):
        """Return the angle [rad] at which the wire is as long as the arm lets it."""
        def gap(theta):
            return self.stage.peek(self.load(theta) - x) - self.length(theta)

        grid = np.linspace(LOW, HIGH, 400)
        values = np.array([gap(theta) for theta in grid])
        change = np.flatnonzero(np.diff(np.sign(values)))
        assert len(change) == 1
        theta = optimize.brentq(gap, grid[change[0]], grid[change[0] + 1], xtol=1e-12)
        self.stage.step(self.load(theta) - x)
        return theta


X = [3.0, 8.0, 5.0, 11.0, 2.0, 6.5, 6.4, 13.0, 0.5]


def test_angles_are_those_of_brute_force():
    made, brute = balance(), Brute(0.5)
    for x in X:
        assert made.step(x, 30.0) == pytest.approx(brute.step(x), abs=5e-7)


def test_angles_with_stretch_stroke_and_shift_are_those_of_brute_force():
    made = balance('stress_dependence', 'series_compliance', 'stress_dependent_strain')
    base = MODEL.length_stage.output_range[0]

    def load(theta):
        return 1.15 * GEOMETRY.force(theta) - 0.15 * 3.0

    def length(theta):
        force = GEOMETRY.force(theta)
        share = ((1.0 - 0.5 * np.exp(-force / 3.6)) / (1.0 - 0.5 * math.exp(-1.0 / 1.2)))
        return base + (GEOMETRY.length(theta) - 0.05e-3 * force - base) / share

    brute = Brute(0.5, load, length)
    for x in X:
        assert made.step(x, 30.0) == pytest.approx(brute.step(x), abs=5e-7)


def test_offset_is_added_to_the_length_whatever_the_load_does_to_the_stroke():
    made = balance('stress_dependent_strain')
    base, stage = made.base, made.operators[0]
    for x, offset, factor in ((5.0, 1e-3, 1.0), (8.0, -1e-3, 0.9), (4.0, 5e-4, 1.05)):
        theta = made.step(x, 30.0, offset, factor)
        force = GEOMETRY.force(theta)
        share = (1.0 - 0.5 * np.exp(-force / 3.6)) / (1.0 - 0.5 * math.exp(-1.0 / 1.2))
        assert stage.input == pytest.approx(force - x, abs=1e-5)
        assert GEOMETRY.length(theta) == pytest.approx(
            base + share * factor * (stage.output - base) + offset, abs=1e-8)


def test_offset_and_stroke_change_the_length_of_a_plain_muscle():
    made = balance()
    base, stage = made.base, made.operators[0]
    for x, offset, factor in ((5.0, 1e-3, 1.0), (8.0, -1e-3, 0.9), (4.0, 5e-4, 1.05)):
        theta = made.step(x, 30.0, offset, factor)
        assert stage.input == pytest.approx(GEOMETRY.force(theta) - x, abs=1e-5)
        assert GEOMETRY.length(theta) == pytest.approx(
            base + factor * (stage.output - base) + offset, abs=1e-8)


class Buckling(MaterialEffect):
    """A cable that gives way about one load, so that the arm falls over."""

    id = 'buckling'

    def stretch(self, load, surroundings):
        """Stretch about 7 N."""
        return 1.5e-3 * np.exp(-((load - 7.0) / 0.15) ** 2)


def test_an_arm_that_falls_over_comes_to_rest_on_the_other_side():
    model = MODEL.with_effects([Buckling()])
    made = model.balance(model.chain())
    made.settle(0.5)
    theta = np.linspace(LOW, HIGH, 4000)
    demand = GEOMETRY.length(theta) - Buckling().stretch(GEOMETRY.force(theta), None)
    start = int(np.argmax(np.diff(demand) < 0.0))
    stop = start + 1 + int(np.argmax(demand[start + 1:] > demand[start]))
    assert theta[stop] - theta[start] > 0.05
    drive = np.linspace(0.5, 16.0, 300)
    up = np.array([made.step(float(x), 30.0) for x in drive])
    down = np.array([made.step(float(x), 30.0) for x in drive[::-1]])
    for path in (up, down[::-1]):
        assert path[0] > theta[stop] and path[-1] < theta[start]
        assert np.all(np.diff(path) <= 1e-9)
        assert not np.any((path > theta[start] + 4e-3) & (path < theta[stop] - 4e-3))


@settings(max_examples=30)
@given(st.lists(st.floats(-5.0, 25.0), min_size=1, max_size=15))
def test_angle_follows_the_first_stage_one_way_and_is_always_a_number(sequence):
    made = balance()
    before, last = made.settle(0.5), 0.5
    for x in sequence:
        theta = made.step(x, 30.0)
        assert LOW <= theta <= HIGH
        if x > last:
            assert theta <= before + 1e-9
        elif x < last:
            assert theta >= before - 1e-9
        before, last = theta, x


def test_the_path_does_not_depend_on_how_finely_it_is_sampled():
    coarse, fine = balance(), balance()
    corners = [0.5, 9.0, 4.0, 12.0, 1.0]
    for start, stop in zip(corners[:-1], corners[1:]):
        for x in np.linspace(start, stop, 40)[1:]:
            theta = fine.step(float(x), 0.1)
        assert coarse.step(stop, 30.0) == pytest.approx(theta, abs=1e-8)


def test_start_wipes_the_memory():
    made = balance()
    first = [made.step(x, 30.0) for x in X]
    made.start()
    made.settle(0.5)
    assert [made.step(x, 30.0) for x in X] == pytest.approx(first, abs=1e-9)


def test_friction_sticks_within_its_band_and_slides_at_its_edge():
    made = balance('coulomb_friction', tau_c=0.03)
    theta = made.step(6.0, 30.0)
    # Sliding down the wire pulls against load and friction.
    leverage = 3.0 * GEOMETRY.moment_arm(theta)
    assert made.operators[0].input + 6.0 == pytest.approx(
        (GEOMETRY.load_moment(theta) + 0.03) / leverage, abs=1e-5)
    width = 2.0 * 0.03 / leverage
    for x in (6.0, 6.0 - 0.5 * width, 6.0 - 0.99 * width, 5.99):
        assert made.step(x, 30.0) == theta
    risen = made.step(6.0 - 1.2 * width, 30.0)
    assert risen > theta
    assert made.operators[0].input + 6.0 - 1.2 * width == pytest.approx(
        (GEOMETRY.load_moment(risen) - 0.03) / (3.0 * GEOMETRY.moment_arm(risen)), abs=1e-5)


def test_friction_holds_against_a_drifting_length():
    made = balance('coulomb_friction', tau_c=0.03)
    theta = made.step(6.0, 30.0)
    assert made.step(5.9, 30.0, 1e-5) == theta


def test_the_cold_arm_has_sunk_to_where_friction_holds_it():
    # Every trial begins after a full cycle, so the arm comes from above.
    made = balance('coulomb_friction', tau_c=0.1)
    theta = made.settle(0.5)
    load = (GEOMETRY.load_moment(theta) - 0.1) / (3.0 * GEOMETRY.moment_arm(theta))
    assert made.operators[0].input == pytest.approx(load - 0.5, abs=1e-6)
    assert theta < balance().settle(0.5) - 0.01


def free_arm(x, duration, viscous, inertia, start, compliance=0.0):
    """Integrate the arm on a wire without hysteresis, as its equation of motion says."""
    def slope(t, y):
        theta, speed = y
        # A reversible wire, length = slope * (F - x) + compliance * F, that cannot push.
        force = (GEOMETRY.length(theta) - INTERCEPT + SLOPE * x) / (SLOPE + compliance)
        pull = 3.0 * max(force, 0.0) * GEOMETRY.moment_arm(theta)
        moment = GEOMETRY.load_moment(theta) - pull
        if inertia == 0.0:
            return [moment / viscous, 0.0]
        return [speed, (moment - viscous * speed) / inertia]

    return integrate.solve_ivp(slope, (0.0, duration), [start, 0.0], rtol=1e-8, atol=1e-9,
                               max_step=1e-3, dense_output=True).sol


SLOPE, INTERCEPT = 0.8e-3, -6e-3


def reversible_balance(**effects):
    """Balance with a second stage that is a straight line."""
    model = bicep_model(length_stage=Linear(SLOPE, INTERCEPT, -30.0, 30.0))
    model = model.with_effects(
        [effect_of(model, name, **values) for name, values in effects.items()])
    return model.balance(model.chain())


@pytest.mark.parametrize('dt, tolerance', [(0.001, 0.01), (0.02, 0.06)])
@pytest.mark.parametrize('effects, viscous, inertia, compliance, x', [
    ({'viscous_friction': {'b': 0.5}}, 0.5, 0.0, 0.0, 6.0),
    ({'inertia': {'I': 0.01}}, 0.0, 0.01, 0.0, 6.0),
    ({'inertia': {'I': 0.01, 'b': 0.05}}, 0.05, 0.01, 0.0, 6.0),
    # An acceleration stretches what is elastic in the muscle.
    ({'inertia': {'I': 0.02}, 'series_compliance': {'compliance': 0.3}}, 0.0, 0.02, 0.3e-3, 6.0),
    ({'viscous_friction': {'b': 0.5}, 'series_compliance': {'compliance': 0.3}},
     0.5, 0.0, 0.3e-3, 6.0),
    # So hard a pull that the muscle hangs loose on the way.
    ({'inertia': {'I': 0.05, 'b': 0.02}}, 0.02, 0.05, 0.0, 14.0)])
def test_motion_is_that_of_the_equation_of_motion(
        effects, viscous, inertia, compliance, x, dt, tolerance):
    made = reversible_balance(**effects)
    start = made.settle(4.0)
    true = free_arm(x, 0.5, viscous, inertia, start, compliance)
    time = dt * np.arange(1, int(0.5 / dt) + 1)
    seen = np.array([made.step(x, dt) for _ in time])
    stroke = np.ptp(true(time)[0])
    assert stroke > 0.02
    assert np.max(np.abs(seen - true(time)[0])) < tolerance * stroke


@pytest.mark.parametrize('jitter', [1e-14, 0.2])
def test_a_clock_that_is_not_quite_even_costs_no_accuracy(jitter):
    """Times of a file are decimal: no two of their differences are the same number."""
    start = reversible_balance(viscous_friction={'b': 0.5}).settle(4.0)
    true = free_arm(6.0, 0.6, 0.5, 0.0, start)
    errors = []
    for share in (0.0, jitter):
        made = reversible_balance(viscous_friction={'b': 0.5})
        made.settle(4.0)
        dt = 0.02 * (1.0 + share * np.tile([1.0, -1.0], 12))
        seen = np.array([made.step(6.0, one) for one in dt])
        errors.append(np.sqrt(np.mean((seen - true(np.cumsum(dt))[0])[4:] ** 2)))
    assert errors[1] == pytest.approx(errors[0], rel=0.5)


@pytest.mark.parametrize('inertia, viscous', [(0.003, 0.002), (0.03, 0.02)])
def test_many_swings_keep_their_phase_and_size_at_ten_samples_a_second(inertia, viscous):
    made = reversible_balance(inertia={'I': inertia, 'b': viscous},
                              series_compliance={'compliance': 0.1})
    start = made.settle(4.0)
    true = free_arm(6.0, 4.0, viscous, inertia, start, 0.1e-3)
    time = 0.1 * np.arange(1, 41)
    seen = np.array([made.step(6.0, 0.1) for _ in time])
    swings = true(time)[0]
    assert np.ptp(swings[20:]) > 0.005 * np.ptp(swings)
    assert np.max(np.abs(seen - swings)) < 0.03 * np.ptp(swings)


@pytest.mark.parametrize('start, x, side', [(4.0, 8.0, -1.0), (8.0, 4.0, 1.0)])
def test_dry_friction_is_against_the_motion(start, x, side):
    """Creeping along, the muscle holds the moment less or more the friction's."""
    made = reversible_balance(coulomb_friction={'tau_c': 0.04}, viscous_friction={'b': 0.5})
    made.settle(start)
    made.step(start, 30.0)
    angles = [made.step(x, 0.005) for _ in range(12)]
    speed = (1.5 * angles[-1] - 2.0 * angles[-2] + 0.5 * angles[-3]) / 0.005
    theta, force = angles[-1], made.operators[0].input + x
    assert speed * side > 0.05
    held = 3.0 * force * GEOMETRY.moment_arm(theta)
    assert held == pytest.approx(
        GEOMETRY.load_moment(theta) - 0.5 * speed - side * 0.04, abs=2e-4)


def test_the_pull_that_leaves_the_muscle_loose_does_so():
    made = reversible_balance(inertia={'I': 0.05, 'b': 0.02})
    made.settle(4.0)
    loads = []
    for _ in range(60):
        made.step(14.0, 0.01)
        loads.append(made.operators[0].input + 14.0)
    assert min(loads) == pytest.approx(0.0, abs=1e-9)
    assert max(loads) > 5.0


def test_viscous_friction_vanishes_in_the_long_run_and_blocks_in_the_short():
    made, free = balance('viscous_friction', b=1.0), balance()
    start = made.settle(0.5)
    assert abs(made.step(8.0, 1e-6) - start) < 1e-4
    assert made.step(8.0, 30.0) == pytest.approx(free.step(8.0, 30.0), abs=1e-6)


def test_heavier_arms_ring_and_come_to_rest():
    made = balance('inertia', I=0.01)
    made.step(3.0, 30.0)
    rest = balance()
    rest.step(3.0, 30.0)
    end = rest.step(8.0, 30.0)
    path = np.array([made.step(8.0, 0.02) for _ in range(1500)])
    assert path.min() < end - 0.01
    assert np.ptp(path[-50:]) < 1e-3


@pytest.mark.parametrize('name', ['viscous_friction', 'inertia'])
def test_no_time_moves_nothing(name):
    made = balance(name)
    start = made.settle(0.5)
    assert made.step(9.0, 0.0) == start
    assert made.step(9.0, 0.1) < start


def test_a_load_that_does_not_count_leaves_the_length_to_the_drive():
    made = ArmBalance(MODEL.require_length_stage(), GEOMETRY, MODEL.chain(), loaded=False)
    made.settle(-5.0)
    stage = MODEL.require_length_stage()
    stage.step(5.0)
    for x in (2.0, 5.0, -1.0):
        theta = made.step(x, 30.0)
        assert GEOMETRY.length(theta) == pytest.approx(stage.step(-x), abs=2e-8)


class Wires(MaterialEffect):
    """Three muscles of given excess lengths, equal ones included."""

    id = 'wires'

    def __init__(self, *offsets):
        super().__init__()
        self.offsets = offsets


@pytest.mark.parametrize('names', [(), ('coulomb_friction',), ('viscous_friction',),
                                   ('stress_dependent_strain', 'coulomb_friction'),
                                   ('transformation_slopes',)])
def test_equal_muscles_in_parallel_are_one(names):
    one = balance(*names)
    model = MODEL.with_effects([*(effect_of(MODEL, name) for name in names), Wires(0., 0., 0.)])
    three = model.balance(model.chain())
    assert len(three.operators) == 3
    assert three.settle(0.5) == pytest.approx(one.settle(0.5), abs=1e-8)
    for n, x in enumerate(X):
        offset = 1e-4 * n
        assert three.step(x, 0.5, offset, 0.98) == pytest.approx(
            one.step(x, 0.5, offset, 0.98), abs=2e-6)
        # While friction holds one muscle, nothing of it is worked out.
        if 'coulomb_friction' not in names:
            assert three.output == pytest.approx(one.output, abs=1e-7)


@pytest.mark.parametrize('more', [(), ('transformation_slopes',), ('cable_friction',)])
def test_friction_that_is_larger_at_rest_holds_longer_and_lets_go_to_the_same_place(more):
    """On a steady way up, which leaves the same memory: it moves in jumps of half its friction."""
    models = [MODEL.with_effects([effect_of(MODEL, 'coulomb_friction', tau_c=0.02, rest=share),
                                  *(effect_of(MODEL, name) for name in more)])
              for share in (0.0, 0.5)]
    arms = [model.balance(model.chain()) for model in models]
    for arm in arms:
        arm.settle(0.5)
    inputs = np.arange(4.0, 8.0, 0.005)
    angles = np.array([[arm.step(x, 30.0) for arm in arms] for x in inputs])
    moves = np.flatnonzero(np.diff(angles[:, 1])) + 1
    assert 3 < len(moves) < 0.2 * np.count_nonzero(np.diff(angles[:, 0]))
    np.testing.assert_allclose(angles[moves, 1], angles[moves, 0], rtol=0.0, atol=1e-7)
    if not more:
        # Half the friction more, before it lets go.
        leverage = GEOMETRY.muscle_count * GEOMETRY.moment_arm(angles[moves[:-1], 1])
        assert np.diff(inputs[moves]) == pytest.approx(0.5 * 0.02 / leverage, abs=0.006)


@pytest.mark.parametrize('names, tolerance', [
    (('inertia',), 0.05), (('inertia', 'series_compliance'), 1e-4),
    (('viscous_friction', 'series_compliance'), 1e-5)])
def test_equal_muscles_swing_like_one(names, tolerance):
    # Wires of the paper.
    model = bicep_model(names, mean_load=PAPER.load)
    one, three = (made.balance(made.chain()) for made in (
        model, model.with_effects([*model.effects, Wires(0., 0., 0.)])))
    for arm in (one, three):
        arm.settle(0.5)
    both = np.array([[arm.step(x, 0.1) for arm in (one, three)]
                     for x in np.repeat([3.0, 6.0, 4.0, 7.0, 5.0], 40)])
    assert np.max(np.abs(np.diff(both))) < tolerance * np.ptp(both[:, 0])


@pytest.mark.parametrize('elastic, strain, g', [
    (None, {}, 0.0), (0.3, {}, 0.0), (0.3, {'r': 0.5, 'F0': 0.8, 'growth': 0.1}, 0.0),
    (None, {}, 0.3), (0.3, {'r': 0.5, 'F0': 0.8}, -0.3)])
def test_unequal_muscles_share_the_load_of_brute_force(elastic, strain, g):
    """Each strains and stretches, and has a loop, as its own load says."""
    offsets = (-0.8e-3, 0.0, 1.2e-3)
    names = {'unequal_muscles': {'shorter': 0.8, 'longer': 1.2}, 'stress_dependent_strain': strain,
             'transformation_slopes': {'g': g}}
    compliance = COMPLIANCE * MODEL.surroundings.over_paper('compliance')
    if elastic:
        names['series_compliance'] = {'compliance': elastic}
        compliance = 1e-3 * elastic
    model = MODEL.with_effects([effect_of(MODEL, name, **values)
                                for name, values in names.items()])
    chain = model.chain()
    made = model.balance(chain)
    stages = [MODEL.require_length_stage() for _ in offsets]
    base = stages[0].output_range[0]
    for x in [0.5, *X]:
        def lacking(theta, commit=False, x=x):
            load = GEOMETRY.force(theta)
            stretch = chain.stretch(load)
            total = 0.0
            for stage, excess in zip(stages, offsets):
                def played(v, stage=stage):
                    return min(max(stage.input, v - chain.loop_width(v + x)), v)

                def missing(v, stage=stage, excess=excess, played=played):
                    # What a wire bears more than the mean stretches it, too.
                    return (base + chain.scale(v + x) * (stage.peek(played(v)) - base)
                            + compliance * (v + x - load)
                            - (GEOMETRY.length(theta) - stretch - excess))
                v = optimize.brentq(missing, -200.0, 200.0, xtol=1e-13)
                total += max(v + x, 0.0)
                if commit:
                    stage.step(played(v))
            return load - total / 3.0

        theta = optimize.brentq(lacking, 0.9, 2.3, xtol=1e-12)
        lacking(theta, commit=True)
        assert made.step(x, 30.0) == pytest.approx(theta, abs=2e-6)


def test_friction_holds_unequal_muscles_by_what_they_pull_together():
    made = balance('unequal_muscles', 'coulomb_friction')
    theta = made.step(6.0, 30.0)
    leverage = 3.0 * GEOMETRY.moment_arm(theta)
    tension = np.mean([operator.input + 6.0 for operator in made.operators])
    assert tension == pytest.approx((GEOMETRY.load_moment(theta) + 0.02) / leverage, abs=1e-4)
    width = 2.0 * 0.02 / leverage
    stiff = [made.step(6.0 - share * width, 30.0) - theta for share in (0.3, 0.6, 0.9)]
    assert stiff == [0.0, 0.0, 0.0]
    # The wires stretch while the arm sticks, but no more than the drive has changed.
    tension = np.mean([operator.input + 6.0 - 0.9 * width for operator in made.operators])
    rest = GEOMETRY.load_moment(theta) / leverage
    assert rest - 0.5 * width < tension < rest
    assert made.step(6.0 - 2.0 * width, 30.0) > theta


@given(st.lists(st.floats(0.0, 2e-3), min_size=2, max_size=4), st.floats(0.5, 12.0),
       st.floats(0.2, 0.8))
def test_drive_of_a_bundle_undoes_its_share(offsets, load, share):
    stage = MODEL.require_length_stage()
    bundle = Bundle(stage, MODEL.with_effects([Wires(*offsets)]).chain(), True)
    low, high = stage.output_range
    output = low + share * (high - low)
    x = bundle.drive(output, load)
    found, following = bundle.respond(x, load, low - 0.1, high + 0.1, low)
    assert found == pytest.approx(output, abs=1e-9)
    assert np.mean(np.maximum(following[:, LOAD] + x, 0.0)) == pytest.approx(load, rel=1e-6)


def test_bundle_stays_within_the_limits_of_its_search():
    bundle = Bundle(MODEL.require_length_stage(),
                    MODEL.with_effects([Wires(0.0, 1e-3)]).chain(), True)

    def place(load, near):
        return bundle.respond(0.0, load, -0.02, 0.0, near)[0]

    assert place(1e9, -0.01) == 0.0
    assert place(-1e9, -0.01) == -0.02
    assert place(1e9, 5.0) == 0.0


def test_a_stiff_wire_does_not_cut_time_into_endless_pieces():
    model = MODEL.with_effects([effect_of(MODEL, 'series_compliance', compliance=1e-290),
                                effect_of(MODEL, 'inertia', I=0.01)])
    chain = model.chain()
    assert chain.compliance() == 0.0
    made = model.balance(chain)
    made.settle(0.5)
    assert math.isfinite(made.step(8.0, 0.1))
    light = balance('inertia', I=1e-200, b=0.02)
    assert light.step(8.0, 0.1) == pytest.approx(balance('viscous_friction', b=0.02).step(8.0, 0.1))
    stiff = MODEL.with_effects([effect_of(MODEL, 'series_compliance', compliance=0.2)])
    assert stiff.chain().compliance() == pytest.approx(0.2e-3)


def test_arms_of_one_geometry_share_statics_that_none_of_them_can_change():
    statics = statics_of(GEOMETRY)
    assert statics_of(dataclasses.replace(GEOMETRY)) is statics
    heavier = statics_of(dataclasses.replace(GEOMETRY, payload_mass=GEOMETRY.payload_mass + 0.1))
    assert np.all(heavier.moment > statics.moment)
    with pytest.raises(ValueError):
        statics.moment[0] = 0.0
