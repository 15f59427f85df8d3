# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Operators of each kind fitted to inputs and outputs, and the search for H1 without forces."""

import numpy as np
import pytest

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.first_stage import first_stage_from_lengths, power_stage
from hysteresis_ros.identification.operators import (
    fit_operator, fit_preisach, preisach_rows, thinned)
from hysteresis_ros.operators import BoucWen, Linear, Preisach, PrandtlIshlinskii

OSCILLATION = np.concatenate([np.linspace(a, b, n + 1)[1:] for a, b, n in (
    (0, 6, 15), (6, 0, 15), (0, 5.6, 13), (5.6, 0.8, 11), (0.8, 5, 9), (5, 1.8, 8), (1.8, 4, 6))])
RANDOM = np.random.default_rng(5).uniform(0.0, 6.0, 60)


def parts_of(operator):
    """Return inputs and outputs of two trials of an operator on 0 to 6."""
    parts, outputs = [], []
    for inputs in (OSCILLATION, OSCILLATION[::-1]):
        operator.reset()
        part = np.append(0.0, inputs)
        parts.append(part)
        outputs.append(operator.simulate(part)[1:])
    groups = np.repeat([0, 1], len(OSCILLATION))
    return parts, np.concatenate(outputs), groups


def error(found, operator):
    """Return the mean error on random inputs as a share of the range."""
    outputs = []
    for one in (found, operator):
        one.reset()
        outputs.append(one.simulate(np.append(0.0, RANDOM)))
    return np.mean(np.abs(outputs[0] - outputs[1])) / np.ptp(outputs[1])


def preisach(levels=5):
    beta, alpha = np.triu_indices(levels)
    return Preisach(np.linspace(0.0, 6.0, levels + 1), 0.3 * np.exp(-(alpha - beta) / 2.0) + 0.1,
                    2.0, np.linspace(0.2, 0.6, levels))


@pytest.mark.parametrize('kind, operator, limit', [
    ('preisach', preisach(), 2e-3),
    ('play', PrandtlIshlinskii([0.0, 0.6, 1.2], [1.0, 0.5, 2.0], 3.0, 0.0, 6.0), 2e-3),
    ('linear', Linear(2.0, -1.0, 0.0, 6.0), 1e-9),
    ('bouc-wen', BoucWen(0.5, 2.0, 0.8, 1.5, 1.4, 1.0, 0.0, 6.0), 5e-3)])
def test_an_operator_of_its_own_kind_is_recovered(kind, operator, limit):
    parts, target, groups = parts_of(operator)
    found, fit = fit_operator(kind, parts, target, groups, 5)
    assert type(found) is type(operator)
    assert error(found, operator) < limit
    assert (fit is None) == (kind in ('linear', 'bouc-wen'))


def test_least_squares_agrees_with_the_operator():
    parts, target, groups = parts_of(preisach(7))
    for reversible in (True, False):
        found, fit = fit_operator('preisach', parts, target, groups, 4, reversible=reversible)
        outputs = []
        for part in parts:
            found.reset()
            outputs.append(found.simulate(part)[1:])
        assert np.concatenate(outputs) == pytest.approx(fit.fitted, abs=1e-9)
        assert np.any(found.reversible) == reversible


def test_reversible_weights_fit_what_hardly_loops():
    operator = PrandtlIshlinskii([0.0, 0.05], [1.0, 0.1], 0.0, 0.0, 6.0)
    parts, target, groups = parts_of(operator)
    errors = [error(fit_operator('preisach', parts, target, groups, 10, reversible=reversible)[0],
                    operator) for reversible in (True, False)]
    assert errors[0] < 2e-3 < 5e-3 < errors[1]


def test_grid_is_placed_where_it_fits_better():
    # Jumps a third of an interval off the usual grid.
    width = 6.0 / 8
    truth = Preisach(np.arange(-1, 10) * width + width / 3, np.where(
        np.arange(55) % 3 == 0, 1.0, 0.0), 0.0)
    parts, outputs = [], []
    for inputs in (OSCILLATION, OSCILLATION[::-1]):
        truth.reset()
        parts.append(np.append(0.0, inputs))
        outputs.append(truth.simulate(parts[-1])[1:])
    target, groups = np.concatenate(outputs), np.repeat([0, 1], len(OSCILLATION))
    usual, placed = (fit_operator('preisach', parts, target, groups, 8, placed=placed)
                     for placed in (False, True))
    assert placed[1].rmse < usual[1].rmse
    for operator, _ in (usual, placed):
        assert operator.lower <= 0.0 and operator.upper >= 6.0
        assert operator.lower >= -0.31 and operator.upper <= 6.31


def test_rows_are_areas_and_lengths():
    nodes, inputs = np.linspace(0.0, 6.0, 4), np.array([1.0, 5.0, 2.5])
    rows = preisach_rows(nodes, inputs, reversible=True)
    assert rows.shape == (3, 9)
    assert rows[1, 6:] == pytest.approx([2.0, 2.0, 0.0])
    assert np.array_equal(preisach_rows(nodes, inputs), rows[:, :6])


def test_thinned_rows_keep_the_memory():
    generator = np.random.default_rng(2)
    drive = np.concatenate([np.linspace(a, b, 200) for a, b in generator.uniform(0, 6, (8, 2))])
    drive = np.append(drive, np.repeat(drive[-1], 5))
    rows = thinned(drive, 50)
    assert rows[0] == 0 and rows[-1] == len(drive) - 1 and len(rows) < 75
    whole, some = preisach(), preisach()
    assert some.simulate(drive[rows]) == pytest.approx(whole.simulate(drive)[rows], abs=1e-9)
    assert thinned(np.array([1.0, 2.0]), 50).tolist() == [0, 1]
    assert thinned(np.ones(4), 1).tolist() == [0, 3]


@pytest.mark.parametrize('exponent', [1.0, 1.7, 3.0])
def test_power_stage_is_a_power_of_the_drive(exponent):
    stage = power_stage(2.0, exponent, 1.0, 5.0, 400)
    drive = np.linspace(1.0, 5.0, 31)
    expected = 8.0 * ((drive - 1.0) / 4.0) ** exponent
    assert [stage.step(v) for v in drive] == pytest.approx(expected, abs=1e-3)
    assert [stage.step(v) for v in drive[::-1]] == pytest.approx(expected[::-1], abs=1e-3)


@pytest.mark.parametrize('exponent', [1.0, 2.0])
def test_first_stage_is_found_from_the_shift_between_loads(exponent):
    truth = power_stage(2.5, exponent, 0.0, 6.0, 60)
    second = Preisach(np.linspace(-16.0, 5.0, 8), 1e-4 * np.exp(
        -np.square(np.add(*np.triu_indices(7)) - 7.0) / 8.0), 0.0)
    drives, loads, lengths = [], [], []
    for load in (0.5, 1.5, 3.0, 4.5):
        second.reset()
        x = truth.simulate(np.append(0.0, OSCILLATION))
        drives.append(OSCILLATION)
        loads.append(np.full(len(OSCILLATION), load))
        lengths.append(second.simulate(load - x)[1:])
    found = first_stage_from_lengths(drives, loads, lengths, 0.0, 30, squared=True)
    drive = np.linspace(0.0, 6.0, 13)
    wanted = np.array([truth.peek(v) for v in drive])
    got = np.array([found.peek(v) for v in drive])
    assert np.mean(np.abs(got - wanted)) < 0.06 * np.ptp(wanted)


def test_first_stage_of_one_load_is_any_that_is_finite():
    found = first_stage_from_lengths([OSCILLATION], [np.full(len(OSCILLATION), 2.0)],
                                     [-OSCILLATION], 0.0, 5, squared=False)
    assert isinstance(found, Linear) and 0.0 < found.slope < np.inf


def test_inputs_that_do_not_vary_and_kinds_that_are_not_there_are_refused():
    with pytest.raises(IdentificationError, match='does not vary'):
        fit_operator('preisach', [np.ones(4)], np.arange(3.0), np.zeros(3), 5)
    with pytest.raises(IdentificationError, match="no operator of kind 'relay'"):
        fit_operator('relay', [np.arange(4.0)], np.arange(3.0), np.zeros(3), 5)


def test_one_level_is_enough_for_a_fit():
    parts, target, groups = parts_of(preisach(1))
    found, _ = fit_preisach(parts, target, np.array([0.0, 6.0]), groups=groups)
    assert error(found, preisach(1)) < 2e-3
