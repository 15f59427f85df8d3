# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The Bouc-Wen operator against its differential equation, and its inverse."""

import json
import math

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import hyp2f1, psi

from hysteresis_ros.errors import ParameterError
from hysteresis_ros.kernels import bouc_wen as kernel
from hysteresis_ros.operators import BoucWen, operator_from_dict


def example(stiffness=0.3, gain=2.0, rate=1.2, shape=0.8, exponent=1.7, **more):
    """Return an operator over -2 to 3."""
    return BoucWen(stiffness, gain, rate, shape, exponent, 0.4, -2.0, 3.0, **more)


# Dead zones that steepen and then flatten; and a gain almost as negative as it may be.
BENT = {'thresholds': [0.0, 1.0], 'bends': [1.5, -2.3]}
LAGGING = {'stiffness': 1.0, 'gain': -0.45, 'rate': 1.3, 'shape': 0.8, 'exponent': 1.7}


@pytest.mark.parametrize('shape', [0.5, 0.8, 2.5])
@pytest.mark.parametrize('exponent', [1.0, 1.7, 2.0, 5.0])
def test_steps_solve_the_differential_equation(shape, exponent):
    operator = example(shape=shape, exponent=exponent)
    w, u = -1.0, -2.0
    for end in (1.0, -0.5, 2.0, 3.0, 0.3, 0.4):
        def slope(_, state, side=math.copysign(1.0, end - u)):
            w = state[0]
            return [1.2 * (1.0 - shape * side * abs(w) ** (exponent - 1.0) * w
                           + (shape - 1.0) * abs(w) ** exponent)]

        w = solve_ivp(slope, (u, end), [w], rtol=1e-10, atol=1e-12).y[0, -1]
        u = end
        assert operator.step(u) == pytest.approx(0.4 + 0.3 * u + 2.0 * w, abs=1e-7)


def test_exponent_one_is_an_exponential():
    operator = BoucWen(0.0, 1.0, 2.0, 0.5, 1.0, 0.0, 0.0, 9.0)
    # From w = -1: straight to 0 with sigma = 1/2, then 1 - exp(-rho u).
    assert operator.step(0.5) == pytest.approx(0.0, abs=1e-14)
    assert operator.step(1.5) == pytest.approx(1.0 - math.exp(-2.0), abs=1e-14)
    # Close to saturation and on into it, where the series around the pole takes over.
    assert operator.step(5.5) == pytest.approx(1.0 - math.exp(-10.0), abs=1e-14)
    assert operator.step(9.0) == pytest.approx(1.0 - math.exp(-17.0), abs=1e-14)


@pytest.mark.parametrize('exponent', [1.0, 1.5, 2.0, 6.0])
def test_sampling_of_a_ramp_makes_no_difference(exponent):
    once, often = example(exponent=exponent), example(exponent=exponent)
    for end in (2.5, -1.0, 1.0, 3.0):
        for u in np.linspace(often.input, end, 300):
            often.step(u)
        assert once.step(end) == pytest.approx(often.step(end), abs=1e-11)


@settings(deadline=None, max_examples=80, derandomize=True)
@given(st.lists(st.floats(-2.5, 3.5), max_size=8), st.floats(0.0, 1.0),
       st.sampled_from([1.0, -1.0]), st.sampled_from([1.0, 1.7, 3.0]),
       st.sampled_from([(0.3, 2.0), (1.0, -0.5), (1.0, -0.3)]), st.sampled_from([{}, BENT]))
def test_inverse_gives_the_reference_that_can_be_reached(
        inputs, share, sign, exponent, line, curve):
    stiffness, gain = line
    operator = example(sign * stiffness, sign * gain, 1.25, exponent=exponent, **curve)
    for u in inputs:
        operator.step(u)
    low, high = sorted((operator.peek(-2.0), operator.peek(3.0)))
    full = operator.output_range[1] - operator.output_range[0]
    y = low + share * (high - low)
    found = operator.invert(y)
    assert operator.peek(found.input) == found.output
    assert abs(found.output - y) < 1e-11 * full
    assert not found.saturated
    for beyond, end in ((high + 0.1, high), (low - 0.1, low)):
        found = operator.invert(beyond)
        assert found.saturated and found.output == pytest.approx(end, abs=1e-11 * full)


def test_nothing_but_numbers_comes_out():
    operator = example()
    y = operator.step(1.0)
    assert operator.step(math.nan) == y and operator.saturated
    assert operator.peek(math.nan) == y
    for bad in (math.nan, math.inf, -math.inf):
        assert operator.invert(bad) == (1.0, y, True)
    assert operator.step(math.inf) == operator.step(3.0)
    assert np.all(np.isfinite(operator.simulate([-math.inf, math.nan, 1.0, math.inf, 1e308])))
    assert operator.invert(1e300).saturated
    for steep in (BoucWen(0.0, 1.0, 1e100, 100.0, 100.0, 0.0, -1e50, 1e50),
                  BoucWen(0.0, 1.0, 1e-100, 100.0, 1.0, 0.0, -1.0, 1.0)):
        for u in (0.5, -0.3, 0.31, 0.2):
            assert -1.0 <= steep.step(u) <= 1.0
            assert math.isfinite(steep.invert(0.1).output)


def test_without_stiffness_saturation_is_a_plateau():
    operator = BoucWen(0.0, 1.0, 50.0, 0.5, 1.0, 0.0, 0.0, 9.0)
    operator.step(8.0)
    assert operator.output == 1.0
    assert operator.invert(1.0) == (8.0, 1.0, False)
    assert operator.step(9.0) == 1.0
    flat = BoucWen(0.0, 0.0, 1.0, 0.5, 1.0, 0.7, 0.0, 9.0)
    assert flat.invert(0.7) == (0.0, 0.7, False)
    assert flat.invert(1.0) == (0.0, 0.7, True)


def test_a_negative_gain_makes_the_output_lag():
    operator = example(**LAGGING)
    rising = operator.simulate(np.linspace(-2.0, 3.0, 60))
    falling = operator.simulate(np.linspace(3.0, -2.0, 60))
    assert np.all(np.diff(rising) > 0.0) and np.all(np.diff(falling) < 0.0)
    assert np.all(rising[1:-1] < falling[::-1][1:-1])
    leading = example(gain=0.45)
    assert np.all(leading.simulate(np.linspace(-2.0, 3.0, 60))[1:-1]
                  > leading.simulate(np.linspace(3.0, -2.0, 60))[::-1][1:-1])


def test_dead_zones_bend_the_output_and_nothing_else():
    straight, bent = example(**LAGGING), example(**LAGGING, **BENT)
    u = np.random.default_rng(0).uniform(-2.0, 3.0, 40)
    x = straight.simulate(u) - 0.4
    assert bent.simulate(u) == pytest.approx(
        0.4 + x + 1.5 * np.maximum(x, 0.0) - 2.3 * np.maximum(x - 1.0, 0.0))
    assert bent.save() == straight.save()


@pytest.mark.parametrize('operator', [
    example(), example(**LAGGING), example(**LAGGING, **BENT), example(exponent=1.0, shape=0.5)])
def test_a_sequence_is_as_many_steps(operator):
    u = np.concatenate([np.random.default_rng(1).uniform(-2.5, 3.5, 50), [3.2, 3.4, 0.1, 0.1]])
    twin = operator_from_dict(operator.to_dict())
    assert operator.simulate(u) == pytest.approx([twin.step(v) for v in u], abs=1e-12)
    assert operator.save() == twin.save()
    assert operator.simulate([0.2, math.nan, 9.0]) == pytest.approx(
        [twin.step(v) for v in (0.2, math.nan, 9.0)], abs=1e-12)
    assert operator.save() == twin.save()


@pytest.mark.parametrize('exponent', [1.0, 1.4, 2.0, 7.0, 100.0])
def test_compiled_travel_is_the_hypergeometric_function(exponent):
    b = 1.0 / exponent
    pole = float(psi(1.0) - psi(b))
    for w in (-1.0, -0.6, -1e-6, 0.0, 0.3, 0.7, 0.95, 0.999):
        for curl in (0.0, 0.6, 30.0, 199.0):
            z = -curl * (-w) ** exponent if w < 0.0 else w ** exponent
            expected = w * hyp2f1(1.0, b, 1.0 + b, z)
            found = kernel.travel(w, 1.0 - w, curl, exponent, pole)
            assert found == pytest.approx(expected, rel=1e-11)
            back = kernel.reached(found, curl, exponent, pole)
            assert back == pytest.approx(w, abs=1e-12)


def test_a_file_without_dead_zones_is_read():
    old = {key: value for key, value in example().to_dict().items()
           if key not in ('thresholds', 'bends')}
    assert operator_from_dict(old).simulate([1.0, 2.0, 0.5]) == pytest.approx(
        example().simulate([1.0, 2.0, 0.5]), abs=0.0)


@pytest.mark.parametrize('change, message', [
    ({'stiffness': -0.1}, 'both signs'),
    ({'stiffness': 1.0, 'gain': -0.53}, 'both signs, and a gain beyond 0.520833'),
    ({'thresholds': [1.0, 0.0], 'bends': [1.0, 1.0]}, 'strictly increasing'),
    ({'thresholds': [1.0], 'bends': [-1.0]}, 'stay positive'),
    ({'rate': 0.0}, 'above 0'),
    ({'shape': 0.4}, 'at least 0.5'),
    ({'shape': 1e9}, 'at most 100'),
    ({'exponent': 0.9}, '1 to 100'),
    ({'upper': -3.0}, 'not below'),
    ({'gain': 1e101}, 'another unit'),
    ({'gain': math.inf}, 'finite'),
])
def test_parameters_that_make_no_sense_are_refused(change, message):
    good = example().to_dict()
    with pytest.raises(ParameterError, match=message):
        operator_from_dict({**good, **change})


def test_memory_and_parameters_come_back():
    operator = example()
    operator.simulate([1.0, -1.0, 2.0, 0.7])
    twin = operator_from_dict(json.loads(json.dumps(operator.to_dict())))
    twin.restore(json.loads(json.dumps(operator.save())))
    assert twin.output == operator.output and twin.direction == -1.0
    assert twin.step(1.3) == operator.step(1.3)
    before = operator.save()
    for change in ({'state': 1.5}, {'state': math.nan}, {'input': 4.0}, {'kind': 'play'}):
        with pytest.raises(ParameterError):
            operator.restore({**before, **change})
    assert operator.save() == before
    operator.reset()
    assert operator.save() == example().save()
