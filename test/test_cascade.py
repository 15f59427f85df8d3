# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Two stages and N stages, the line, and the additive model."""

import json
import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.operators import (
    Additive, BoucWen, Cascade, Linear, PrandtlIshlinskii, Preisach, operator_from_dict,
    signed_areas)


def stage(levels, lower, upper, seed, scale):
    """Return a Preisach operator with some cells empty and a given full scale."""
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.0, 1.0, levels * (levels + 1) // 2) + 0.1
    operator = Preisach(np.linspace(lower, upper, levels + 1), weights)
    low, high = operator.output_range
    return Preisach(operator.nodes, weights * scale / (high - low), scale / 2.0)


def two_stages():
    """Return H1 from 0..6 V to 0..15 N and H2 from -16..16 N to 0..0.02 m."""
    return Cascade([stage(10, 0.0, 6.0, 0, 15.0), stage(20, -16.0, 16.0, 1, 0.02)])


def test_linear_operator_is_a_line():
    line = Linear(2.0, -1.0, 0.0, 3.0)
    assert (line.input, line.output, line.output_range) == (0.0, -1.0, (-1.0, 5.0))
    assert line.step(2.0) == 3.0 and line.peek(1.0) == 1.0 and line.direction == 1.0
    assert line.step(4.0) == 5.0 and line.saturated
    assert line.step(math.nan) == 5.0 and line.peek(math.nan) == 5.0 and line.saturated
    assert line.invert(1.0) == (1.0, 1.0, False)
    assert line.invert(9.0) == (3.0, 5.0, True)
    assert line.invert(math.nan) == (3.0, 5.0, True)
    assert Linear(0.0, 1.0, 0.0, 3.0).invert(1.0) == (0.0, 1.0, False)
    assert Linear(0.0, 1.0, 0.0, 3.0).invert(2.0) == (0.0, 1.0, True)
    falling = Linear(-2.0, 0.0, 0.0, 3.0)
    assert falling.invert(-4.0).input == 2.0 and falling.output_range == (-6.0, 0.0)
    falling.step(1.0)
    assert falling.peek(2.0) == -4.0 and falling.invert(-1.0).input == 0.5


def test_linear_operator_in_batches_and_files():
    line, twin = Linear(2.0, -1.0, 0.0, 3.0), Linear(2.0, -1.0, 0.0, 3.0)
    for inputs in ([1.0, 2.0, 0.5, 0.5], [0.5] * 4, [4.0, 5.0, 4.5], [math.nan, 1.0, 2.0], [2.5]):
        expected = [line.step(u) for u in inputs]
        np.testing.assert_array_equal(twin.simulate(inputs), expected)
        assert twin.save() == line.save()
    other = operator_from_dict(json.loads(json.dumps(line.to_dict())))
    other.restore(json.loads(json.dumps(line.save())))
    assert other.output == line.output and other.direction == 1.0
    for bad in ({'slope': math.nan}, {'lower': 3.0}, {'slope': 1e100, 'upper': 1e9}):
        with pytest.raises(ParameterError):
            operator_from_dict({**line.to_dict(), **bad})
    with pytest.raises(ParameterError, match='outside'):
        line.restore({**line.save(), 'input': 9.0})


# Eqs. 7 and 25

def test_stages_are_embedded_with_the_paper_s_signs():
    first, second, third = (
        Linear(2.0, 0.5, -10.0, 10.0), Linear(3.0, 0.1, -99.0, 99.0),
        Linear(-1.5, 0.2, -999.0, 999.0))
    cascade = Cascade([first, second, third])
    expected = -1.5 * (7.0 - (3.0 * (4.0 - (2.0 * 1.25 + 0.5)) + 0.1)) + 0.2
    assert cascade.peek((1.25, 4.0, 7.0)) == pytest.approx(expected)
    assert cascade.step((1.25, 4.0, 7.0)) == pytest.approx(expected)
    assert cascade.output == pytest.approx(expected)
    found = cascade.invert(expected, (4.0, 7.0))
    assert found == (pytest.approx(1.25), pytest.approx(expected), False)


def test_two_stages_are_equation_7():
    cascade, (first, second) = two_stages(), two_stages().stages
    rng = np.random.default_rng(2)
    volts, forces = rng.uniform(0.0, 6.0, 200), np.repeat(rng.uniform(0.5, 15.0, 10), 20)
    expected = [second.step(f - first.step(v)) for v, f in zip(volts, forces)]
    columns = np.column_stack((volts, forces))
    np.testing.assert_allclose(cascade.simulate(columns), expected, atol=1e-12 * 0.02)
    other = two_stages()
    assert [other.step(row) for row in columns] == expected
    assert [a.save() for a in other.stages] == [b.save() for b in cascade.stages]


@pytest.mark.parametrize('dead_bands', [(), (0.0, 0.0)])
def test_length_inverse_is_equations_13_and_14(dead_bands):
    cascade = two_stages()
    rng = np.random.default_rng(3)
    reached = 0
    for y, f in zip(rng.uniform(0.003, 0.017, 400), rng.uniform(0.5, 15.0, 400)):
        found = cascade.invert_length(y, f, dead_bands)
        assert cascade.invert(y, (f,), dead_bands) == found
        predicted = cascade.peek((found.input, f))
        assert found.output == pytest.approx(predicted, abs=1e-11)
        if not found.saturated:
            assert predicted == pytest.approx(y, abs=1e-9 * 0.02)
            reached += 1
        assert cascade.step((found.input, f)) == pytest.approx(predicted, abs=1e-12)
    assert reached > 150


def test_unreachable_length_gives_the_nearest_voltage():
    cascade = two_stages()
    cascade.step((3.0, 5.0))
    reachable = [cascade.peek((v, 5.0)) for v in np.linspace(0.0, 6.0, 601)]
    for y, end in ((1.0, max(reachable)), (-1.0, min(reachable))):
        found = cascade.invert_length(y, 5.0)
        assert found.saturated and 0.0 <= found.input <= 6.0
        assert found.output == cascade.peek((found.input, 5.0)) == pytest.approx(end, abs=1e-12)


def test_numbers_that_are_none_hold_the_drive():
    cascade = two_stages()
    cascade.step((3.0, 5.0))
    for y, f in ((math.nan, 5.0), (0.01, math.nan), (math.inf, 5.0), (0.01, -math.inf)):
        assert cascade.invert_length(y, f) == (3.0, cascade.output, True)
    before = cascade.output
    assert math.isfinite(cascade.step((math.nan, 5.0)))
    assert cascade.step((3.0, math.nan)) == pytest.approx(before)
    assert math.isfinite(cascade.step((math.inf, math.inf)))


def test_dead_bands_calm_the_drive():
    quiet, exact = two_stages(), two_stages()
    rng = np.random.default_rng(5)
    noise = 0.01 + rng.normal(0.0, 1e-6, 200)
    volts = {}
    for name, cascade, bands in (('quiet', quiet, (0.01, 1e-5)), ('exact', exact, ())):
        cascade.step((2.0, 8.0))
        cascade.step((cascade.invert_length(0.01, 8.0).input, 8.0))
        series = []
        for y in noise:
            found = cascade.invert_length(y, 8.0, bands)
            cascade.step((found.input, 8.0))
            series.append(found.input)
            assert abs(cascade.output - y) < 2e-5
        volts[name] = np.ptp(series)
    assert volts['quiet'] < 0.2 * volts['exact']


@settings(deadline=None, max_examples=40, derandomize=True)
@given(st.lists(st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 10.0), st.floats(-5.0, 5.0)),
                min_size=1, max_size=12))
def test_three_stages_of_other_kinds_invert_too(rows):
    cascade = Cascade([
        PrandtlIshlinskii([0.0, 0.4], [0.5, 1.0], 0.0, 0.0, 6.0),
        BoucWen(0.5, 2.0, 0.7, 0.7, 1.5, 0.0, -12.0, 12.0),
        stage(6, -15.0, 15.0, 6, 4.0)])
    for row in rows:
        y = cascade.peek(row)
        found = cascade.invert(y, row[1:])
        assert cascade.peek((found.input, *row[1:])) == pytest.approx(y, abs=4e-9)
        assert cascade.step(row) == pytest.approx(y, abs=1e-12)
        assert cascade.output == pytest.approx(y, abs=1e-12)


# Sec. III-B

def test_additive_model_is_a_difference():
    drive, load = stage(6, 0.0, 6.0, 8, 0.015), stage(5, 0.0, 16.0, 9, 0.01)
    model = Additive(drive, load)
    rng = np.random.default_rng(10)
    inputs = np.column_stack((rng.uniform(0.0, 6.0, 80), rng.uniform(0.0, 16.0, 80)))
    rows = np.column_stack((signed_areas(load.nodes, inputs[:, 1]),
                            -signed_areas(drive.nodes, inputs[:, 0])))
    expected = rows @ np.concatenate((load.weights, drive.weights)) + load.bias - drive.bias
    np.testing.assert_allclose(model.simulate(inputs), expected, atol=1e-14)
    model.reset()
    np.testing.assert_allclose([model.step(row) for row in inputs], expected, atol=1e-14)
    y = load.peek(8.0) - drive.peek(4.0)
    found = model.invert(y, (8.0,))
    assert found.output == pytest.approx(y, abs=1e-12)
    assert model.step((found.input, 8.0)) == pytest.approx(y, abs=1e-12)
    assert model.invert(9.0, (8.0,)).saturated


# Refusals

def test_models_that_make_no_sense_are_refused():
    with pytest.raises(ParameterError, match='at least one'):
        Cascade([])
    for wrong in ((1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError):
            two_stages().step(wrong)
