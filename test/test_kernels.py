# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The compiled kernels against their own source as plain Python, and against the reference."""

import os
import subprocess
import sys
from typing import NamedTuple

from benchmark.reference import arm_of
from hypothesis import given, strategies as st
import numpy as np
import pytest

from hysteresis_ros.effects.base import PAPER
from hysteresis_ros.kernels import grid, trial
from hysteresis_ros.kernels.jit import remember_types
from hysteresis_ros.kernels.plain import Plain
from hysteresis_ros.model import Simulator
from hysteresis_ros.operators import HysteresisOperator
from model_support import arm_run, bicep_model, effect_of, wandering_voltage

VOLTAGE = wandering_voltage(60, seed=5)
ARMS = [(), ('coulomb_friction',), ('viscous_friction', 'coulomb_friction'),
        ('inertia', 'series_compliance'), ('unequal_muscles', 'coulomb_friction'),
        ('stress_dependent_strain', 'r_phase', 'viscous_friction')]

EVERYTHING = """
import sys
import numpy as np
from scipy import sparse
sys.path.insert(0, {tests!r})
from hysteresis_ros.model import Simulator
from hysteresis_ros.identification.nonnegative import solve_rows
from hysteresis_ros.operators import (
    BoucWen, Linear, Preisach, PrandtlIshlinskii, signed_areas, signed_lengths)
from model_support import arm_run, bicep_model, effect_of, STRENGTHS, wandering_voltage
import numba
assert numba.config.DISABLE_JIT == {disabled!r}

rng = np.random.default_rng(3)
nodes = np.array([0.0, 0.7, 1.5, 3.0, 4.1, 6.0])
found = [signed_areas(nodes, rng.uniform(0.0, 6.0, 50)).ravel(),
         signed_lengths(nodes, rng.uniform(0.0, 6.0, 9)).ravel()]
operators = [Preisach(nodes, rng.uniform(0.0, 1.0, 15), 0.3, rng.uniform(0.0, 1.0, 5)),
             PrandtlIshlinskii([0.0, 0.5, 1.0], [1.0, 0.5, 0.2], 0.1, 0.0, 6.0, [2.0], [-0.5]),
             BoucWen(1.0, 2.0, 1.5, 0.5, 2.3, 0.1, 0.0, 6.0), Linear(2.0, 1.0, 0.0, 6.0)]
for operator in operators:
    found.append(operator.simulate(rng.uniform(-1.0, 7.0, 200)))
    low, high = operator.output_range
    for y in rng.uniform(low, high, 100):
        u = operator.invert(y).input
        found.append([u, operator.peek(7.0 - u), operator.step(u)])
found.append(solve_rows(rng.random((20, 40)), rng.random(20), 1e-3 * sparse.identity(
    40, format='csr'), np.arange(40) == 39)[0])
arm = arm_run(wandering_voltage(40, seed=1), 0.1)
model = bicep_model()
simulator = Simulator(model, arm)
for names in [(), *((name,) for name in STRENGTHS), {arms}]:
    found.append(simulator.run([effect_of(model, name) for name in names]))
np.save({path!r}, np.concatenate(found))
"""


def results(root, path, disabled):
    """Return what a process of its own computes, with or without compilation."""
    code = EVERYTHING.format(tests=str(root / 'test'), disabled=int(disabled), path=str(path),
                             arms=', '.join(map(repr, ARMS[1:])))
    environment = {**os.environ, 'NUMBA_DISABLE_JIT': str(int(disabled)), 'PYTHONPATH': str(root)}
    done = subprocess.run([sys.executable, '-c', code], cwd=root, env=environment, check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return np.load(path)


def test_compiled_and_uncompiled_kernels_agree(root, tmp_path):
    compiled = results(root, tmp_path / 'compiled.npy', False)
    plain = results(root, tmp_path / 'plain.npy', True)
    assert len(compiled) > 2000 and np.ptp(compiled) > 1.0
    np.testing.assert_allclose(compiled, plain, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize('dt', [0.1, 30.0])
@pytest.mark.parametrize('names', ARMS)
def test_the_compiled_arm_is_the_reference_in_plain_python(names, dt):
    # Whose wires are those of the paper.
    model = bicep_model(names, mean_load=PAPER.load)
    x = 2.0 * VOLTAGE
    offset = 1e-4 * np.sin(np.arange(len(x)))
    rest, angles, _, _ = model.balance(model.chain()).run(
        0.5, np.array([len(x)]), x, np.full(len(x), dt), offset, np.full(len(x), 0.98))
    reference = arm_of(model)
    # Both search for the same roots by other steps; in motion less exactly.
    exact = 1e-9 if dt == 30.0 else 1e-6
    assert reference.settle(0.5) == pytest.approx(rest, abs=1e-9)
    expected = [reference.step(value, dt, added, 0.98)
                for value, added in zip(x.tolist(), offset.tolist())]
    np.testing.assert_allclose(angles, expected, rtol=0.0, atol=exact)


@given(st.lists(st.integers(-9, 9), min_size=2, max_size=30), st.floats(-11.0, 11.0),
       st.integers(-3, 40))
def test_an_interval_is_found_from_wherever_the_search_begins(values, value, near):
    """Also where entries are alike, and beyond both ends."""
    column = np.sort(np.array(values, dtype=float))
    found = grid.interval(np.column_stack([np.zeros(len(column)), column]), 1, value, near)
    assert found == min(max(np.searchsorted(column, value, 'right'), 1), len(column) - 1)


class Delegate(HysteresisOperator):
    """An operator without kernels, made of one that has them."""

    def __init__(self, operator):
        self.operator = operator
        self.lower, self.upper = operator.lower, operator.upper

    input = property(lambda self: self.operator.input)
    output = property(lambda self: self.operator.output)
    saturated = property(lambda self: self.operator.saturated)
    direction = property(lambda self: self.operator.direction)
    output_range = property(lambda self: self.operator.output_range)

    def reset(self):
        """Forget the history."""
        self.operator.reset()

    def step(self, u):
        """Commit an input."""
        return self.operator.step(u)

    def peek(self, u):
        """Return the output."""
        return self.operator.peek(u)

    def _solve(self, y):
        return self.operator._solve(y)

    def save(self):
        """Return the memory."""
        return self.operator.save()

    def restore(self, state):
        """Take it back."""
        self.operator.restore(state)

    def to_dict(self):
        """Return the parameters."""
        return self.operator.to_dict()

    @classmethod
    def from_dict(cls, parameters):
        """Not needed."""
        raise NotImplementedError


@pytest.mark.parametrize('names', [arm for arm in ARMS if 'unequal_muscles' not in arm])
def test_an_operator_without_kernels_runs_by_the_same_equations(names):
    model = bicep_model()
    other = bicep_model(length_stage=Delegate(model.length_stage))
    effects = [effect_of(model, name) for name in names]
    run = arm_run(VOLTAGE, 0.1)
    np.testing.assert_allclose(Simulator(other, run).run(effects),
                               Simulator(model, run).run(effects), rtol=0.0, atol=1e-12)


def test_muscles_without_kernels_share_the_load():
    # Their wires are elastic only beyond what H2 can give, so the results are not the same.
    model = bicep_model()
    other = bicep_model(length_stage=Delegate(model.length_stage))
    effects = [effect_of(model, 'unequal_muscles', shorter=0.1, longer=0.1)]
    run = arm_run(VOLTAGE[::6])
    np.testing.assert_allclose(Simulator(other, run).run(effects),
                               Simulator(model, run).run(effects), rtol=0.0, atol=0.03)


def test_plain_kernels_are_made_once_and_are_not_compiled():
    plain = Plain()
    assert plain(trial.run) is plain(trial.run)
    assert not hasattr(plain(trial.run), 'py_func')
    assert plain(trial.run).__globals__['step'] is plain(trial.step)


class Table(NamedTuple):
    """A table as kernels take it."""

    values: np.ndarray


def test_remembered_types_know_how_an_array_lies_in_memory():
    numba = pytest.importorskip('numba')
    remember_types(Table)

    @numba.njit
    def corner(table):
        return table.values[1, 0]
    values = np.arange(12.0).reshape(3, 4)
    for way in (values, values.T, values[::2, 1:], values.astype(np.float32)):
        assert corner(Table(way)) == way[1, 0]
