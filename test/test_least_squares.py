# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights of one sign and a free bias: the solver, the choice of strength, and what is reported."""

import json

from hypothesis import given, settings, strategies as st
import numpy as np
import pytest
from scipy import optimize, sparse

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification import nonnegative
from hysteresis_ros.identification.least_squares import (
    Anchor, fit_weights, folds_of, quick_weights, SLACK, solve_nonnegative, STRENGTHS,
    WEAKER_STRENGTHS)
from hysteresis_ros.identification.nonnegative import extrapolated, solve_rows
from hysteresis_ros.identification.smoothness import smoothness
from hysteresis_ros.operators import cell_areas, signed_areas

OSCILLATION = np.concatenate([np.linspace(a, b, n + 1)[1:] for a, b, n in (
    (0, 6, 8), (6, 0, 7), (0, 5.6, 6), (5.6, 0.8, 5), (0.8, 5, 4), (5, 1.8, 3), (1.8, 4.2, 2))])


def problem(seed, rows=30, columns=8, noise=0.01):
    generator = np.random.default_rng(seed)
    design = generator.normal(size=(rows, columns))
    weights = np.maximum(generator.normal(size=columns), 0.0)
    target = design @ weights - 1.5 + noise * generator.normal(size=rows)
    return design, target, weights


def preisach_problem(seed=0, levels=20, loads=(1.0, 2.0, 3.0, 4.5)):
    """Return a problem of the paper's size: four loads, 36 steps, 20 levels."""
    generator = np.random.default_rng(seed)
    nodes = np.linspace(-14.5, 4.5, levels + 1)
    beta, alpha = np.triu_indices(levels)
    truth = np.exp(-0.5 * ((nodes[beta] + 6.0) / 3.0) ** 2
                   - 0.5 * ((nodes[alpha] + 2.0) / 3.0) ** 2)
    parts = [load - 14.5 * (OSCILLATION / 6.0) ** 2 for load in loads]
    rows = np.concatenate([signed_areas(nodes, part) for part in parts])
    target = rows @ truth * 1e-4 + 2e-5 * generator.normal(size=len(rows))
    return nodes, rows, target, np.repeat(np.arange(len(loads)), len(OSCILLATION))


@pytest.mark.parametrize('size, seed', [(5, 3236), (5, 4794), (6, 265), (6, 2206)])
def test_the_solver_leaves_circles(size, seed):
    """Unknowns that change sides together would do so for ever here."""
    generator = np.random.default_rng(seed)
    root = generator.standard_normal((size, size)) * np.exp(2 * generator.standard_normal(size))
    gram, moment = root.T @ root, generator.standard_normal(size)
    x, _ = solve_nonnegative(gram, moment, np.zeros(size, dtype=bool))
    gradient = gram @ x - moment
    assert np.all(x >= 0.0) and np.all(gradient > -1e-9 * np.abs(moment).max())
    assert np.abs(x @ gradient) < 1e-9


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10 ** 6), st.integers(1, 25), st.floats(1e-6, 1.0))
def test_solver_meets_the_optimality_conditions_of_scipys(seed, size, ridge):
    generator = np.random.default_rng(seed)
    design = generator.normal(size=(size + 3, size))
    target = generator.normal(size=size + 3)
    gram = design.T @ design + ridge * np.eye(size)
    moment = design.T @ target
    x, passive = solve_nonnegative(gram, moment, np.zeros(size, dtype=bool))
    triangle = np.linalg.cholesky(gram).T
    expected, _ = optimize.nnls(triangle, np.linalg.solve(triangle.T, moment))
    assert x == pytest.approx(expected, abs=1e-8)
    assert np.all(x >= 0.0) and not np.any(x[~passive])
    again, _ = solve_nonnegative(gram, moment, np.zeros(size, dtype=bool),
                                 generator.random(size) < 0.5)
    assert again == pytest.approx(x, abs=1e-8)


@pytest.mark.parametrize('size, seed', [(80, 0), (120, 19)])
def test_a_start_from_which_no_solution_is_found_is_given_up(size, seed):
    """Unknowns changed sides one at a time, for a minute where there are a thousand."""
    rng, bound = np.random.default_rng(seed), np.zeros(size, dtype=bool)
    rows = size // 2
    there = np.linspace(0.0, 1.0, rows)[:, None] - np.sort(rng.uniform(0.0, 1.0, size))
    design = np.exp(-0.5 * (there / 0.1) ** 2)
    gram = design.T @ design / rows + 5e-7 * np.eye(size)
    target = np.arange(1, rows + 1) / rows + 1e-3 * rng.standard_normal(rows)
    moment = design.T @ target / rows
    expected, inside = solve_nonnegative(gram, moment, bound)
    found, passive = solve_nonnegative(gram, moment, bound, rng.random(size) < 0.6)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
    assert np.array_equal(passive, inside)


@pytest.mark.parametrize('limits', [[], [3, 17]])
def test_what_takes_too_long_is_solved_one_by_one(monkeypatch, limits):
    """As after too many exchanges: whatever was found until then is not used."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(60, 40))
    gram, moment = rows.T @ rows + 1e-3 * np.eye(40), rows.T @ rng.normal(size=60)
    moment[limits] -= 100.0
    free = np.isin(np.arange(40), limits)
    expected, inside = solve_nonnegative(gram, moment, free)
    assert np.any(expected == 0.0) and np.all(expected[limits] < 0.0)
    monkeypatch.setattr(nonnegative, 'pivot', lambda gram, moment, free, passive, *_: (
        np.full(40, np.nan), 2))
    found, passive = solve_nonnegative(gram, moment, free)
    assert found == pytest.approx(expected, abs=1e-12)
    assert np.array_equal(passive, inside)
    with pytest.raises(IdentificationError, match='use a larger strength'):
        solve_nonnegative(-gram, moment, free)


def test_solver_leaves_free_unknowns_without_a_bound():
    x, _ = solve_nonnegative(np.eye(2), np.array([-1.0, -2.0]), np.array([False, True]))
    assert x == pytest.approx([0.0, -2.0])


def test_singular_problem_is_refused():
    with pytest.raises(IdentificationError, match='singular'):
        solve_nonnegative(np.zeros((2, 2)), np.ones(2), np.ones(2, dtype=bool))


@pytest.mark.parametrize('sign', [1, -1])
@pytest.mark.parametrize('seed', range(3))
def test_weak_penalty_recovers_weights_and_bias(seed, sign):
    design, target, weights = problem(seed, noise=0.0)
    fit = fit_weights(design, sign * target, sign=sign, strength=1e-12)
    assert fit.weights == pytest.approx(sign * weights, abs=1e-6)
    assert fit.bias == pytest.approx(sign * -1.5, abs=1e-6)
    assert fit.sign == sign and np.all(fit.weights * sign >= 0.0)
    assert fit.rmse < 1e-6 and fit.mean_percent < 1e-4


def test_sign_is_chosen_by_the_data():
    design, target, _ = problem(5)
    assert fit_weights(design, target, sign=None, strength=1e-6).sign == 1
    assert fit_weights(design, -target, sign=None, strength=1e-6).sign == -1


def test_plain_problem_is_scipys():
    design, target, _ = problem(1, rows=12)
    fit = fit_weights(design, target, strength=0.0)
    both = np.column_stack([design, np.ones(12), -np.ones(12)])
    expected, norm = optimize.nnls(both, target)
    assert fit.weights == pytest.approx(expected[:-2], abs=1e-8)
    assert fit.bias == pytest.approx(expected[-2] - expected[-1], abs=1e-8)
    assert np.sqrt(12) * fit.rmse == pytest.approx(norm, abs=1e-8)
    assert fit.strength == 0.0 and len(fit.strengths) == 0


@pytest.mark.parametrize('strength', [1e-9, 1e-6, 1e-2])
def test_penalised_problem_is_that_of_the_docstring(strength):
    nodes, rows, target, _ = preisach_problem(levels=8)
    scale, penalty = cell_areas(nodes), smoothness(nodes)
    fit = fit_weights(rows, target, scale=scale, penalty=penalty, strength=strength)
    span = np.ptp(target)
    root = np.sqrt(len(target))
    stacked = np.vstack([
        np.column_stack([rows / scale, np.ones(len(rows)), -np.ones(len(rows))]) / root,
        np.column_stack([np.sqrt(strength) * penalty, np.zeros((len(penalty), 2))])])
    expected, _ = optimize.nnls(
        stacked, np.append(target / span / root, np.zeros(len(penalty))), maxiter=10000)
    fitted = (rows / scale) @ expected[:-2] + expected[-2] - expected[-1]
    assert fit.fitted / span == pytest.approx(fitted, abs=1e-7)
    assert fit.weights * scale / span == pytest.approx(expected[:-2], abs=1e-5)


def test_quick_solution_is_the_careful_one():
    nodes, rows, target, _ = preisach_problem(levels=8)
    scale, penalty = cell_areas(nodes), smoothness(nodes)
    fit = fit_weights(rows, target, scale=scale, penalty=penalty, strength=1e-4)
    weights, bias, passive = quick_weights(
        rows, target, scale, 1e-4 * penalty.T @ penalty)
    assert rows @ weights + bias == pytest.approx(fit.fitted, abs=1e-7 * fit.output_range)
    again, _, _ = quick_weights(rows, target, scale, 1e-4 * penalty.T @ penalty, passive)
    assert again == pytest.approx(weights, abs=1e-12)


@pytest.mark.parametrize('rows, columns', [(148, 231), (30, 120), (300, 60)])
def test_weights_are_those_of_scipy_from_any_start(rows, columns):
    rng = np.random.default_rng(rows)
    design, target = rng.normal(size=(rows, columns)), rng.normal(size=rows)
    expected, _ = optimize.nnls(np.vstack([design, np.eye(columns)]),
                                np.append(target, np.zeros(columns)), maxiter=10000)
    gram, moment = design.T @ design + np.eye(columns), design.T @ target
    bounded = np.zeros(columns, dtype=bool)
    for start in (None, expected > 0.0, expected == 0.0, rng.random(columns) < 0.5):
        x, passive = solve_nonnegative(gram, moment, bounded, start)
        assert x == pytest.approx(expected, abs=1e-12)
        assert np.array_equal(passive, expected > 0.0)


@pytest.mark.parametrize('rows, columns, strength', [(148, 500, 1e-3), (40, 300, 1.0)])
def test_weights_found_by_parts_are_those_of_the_whole(rows, columns, strength):
    rng = np.random.default_rng(columns)
    design, target = rng.random(size=(rows, columns)), 5.0 * rng.random(rows)
    root = np.eye(columns) - 0.3 * np.eye(columns, k=1)
    penalty, free = strength * root.T @ root, np.arange(columns) == columns - 1
    expected, inside = solve_nonnegative(
        design.T @ design / rows + penalty, design.T @ target / rows, free)
    assert 2 < np.count_nonzero(inside) < columns // 2
    for start in (None, inside, rng.random(columns) < 0.05, rng.random(columns) < 0.8):
        x, passive = solve_rows(design, target, sparse.csr_matrix(penalty), free, start)
        assert x == pytest.approx(expected, abs=1e-10)
        assert np.array_equal(passive, inside)


def test_no_weight_is_below_zero_by_rounding():
    # A free bias far above them hides the sign of weights that are zero but for rounding.
    x, _ = solve_nonnegative(np.eye(3), np.array([-1e-14, 1e-14, 1.0]),
                             np.array([False, False, True]), np.ones(3, dtype=bool))
    assert x[0] == 0.0 and x[1:] == pytest.approx([1e-14, 1.0])


def test_scale_of_the_data_does_not_matter():
    nodes, rows, target, groups = preisach_problem(levels=8)
    options = {'groups': groups, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    fit = fit_weights(rows, target, **options)
    larger = fit_weights(rows, 1e6 * target + 7.0, **options)
    assert larger.strength == fit.strength
    assert larger.fitted == pytest.approx(1e6 * fit.fitted + 7.0, rel=1e-6)


def test_anchor_is_met_exactly():
    nodes, rows, target, groups = preisach_problem(levels=8)
    options = {'groups': groups, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    value = float(target.max()) + 0.2 * float(np.ptp(target))
    row = signed_areas(nodes, np.array([0.0]))[0]
    for strength in (None, 1e-6, 0.0):
        fit = fit_weights(rows, target, anchor=Anchor(row, value), strength=strength, **options)
        assert fit.predict(row[None])[0] == pytest.approx(value, abs=1e-12)
        assert fit.fitted == pytest.approx(fit.predict(rows), abs=1e-12)
        assert fit.residual == pytest.approx(fit.fitted - target, abs=1e-12)
        assert fit.rmse > fit_weights(rows, target, strength=strength, **options).rmse
        low, high = fit.prediction_interval(row[None])
        assert high - low == pytest.approx(2 * 1.976 * fit.noise_std, rel=2e-3)


def test_folds_are_whole_trials_or_blocks_of_one():
    trials = folds_of(np.array([3, 3, 3, 7, 7, 9]))
    assert [np.flatnonzero(fold).tolist() for fold in trials] == [[0, 1, 2], [3, 4], [5]]
    blocks = folds_of(np.zeros(12))
    assert [np.flatnonzero(fold).tolist() for fold in blocks] == [
        [0, 1, 2], [3, 4, 5], [6, 7], [8, 9], [10, 11]]
    many = folds_of(np.repeat(np.arange(40), 2))
    assert len(many) == 8 and np.all(np.sum(many, axis=0) == 1)


@pytest.mark.parametrize('options', [{'strength': 1e-3}, {'strength': 0.0},
                                     {'strength': 1e-3, 'emphasis': np.linspace(0.5, 1.5, 30)}])
def test_rows_left_out_are_off_as_where_each_is_left_out(options):
    """As long as no weight comes to its bound or leaves it."""
    design, target, _ = problem(3)
    weights = np.linspace(1.0, 2.0, design.shape[1])
    target = design @ weights + 0.1 * np.random.default_rng(4).normal(size=len(target))
    fit = fit_weights(design, target, **options)
    assert np.all(fit.weights > 0.0)
    scale = fit.output_range
    columns = np.column_stack([design, np.ones(len(target))])
    emphasis = options.get('emphasis', np.ones(len(target)))
    emphasis = emphasis / np.sqrt(np.mean(emphasis ** 2))
    bounded = np.append(np.ones(design.shape[1]), 0.0)
    for row in (0, 7, 29):
        rows = np.arange(len(target)) != row
        root = emphasis[rows, None] * columns[rows]
        penalty = len(target) * options['strength'] * np.diag(bounded)
        found = np.linalg.solve(root.T @ root + penalty,
                                root.T @ (emphasis * target)[rows])
        assert fit.rows_left_out[row] == pytest.approx(
            columns[row] @ found - target[row], rel=2e-2, abs=1e-6 * scale)
    assert np.all(np.abs(fit.rows_left_out) > np.abs(fit.residual))


def test_strength_is_the_best_on_held_out_trials():
    nodes, rows, target, groups = preisach_problem()
    scale, penalty = cell_areas(nodes), smoothness(nodes)
    fit = fit_weights(rows, target, groups=groups, scale=scale, penalty=penalty)
    assert fit.strengths == pytest.approx(STRENGTHS)
    assert fit.strength == fit.strengths[np.argmin(fit.validation)]
    errors = []
    for held in folds_of(groups):
        part = fit_weights(rows[~held], target[~held], scale=scale, strength=fit.strength,
                           penalty=penalty)
        errors.append(part.predict(rows[held]) - target[held])
    rmse = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert np.min(fit.validation) == pytest.approx(rmse, rel=1e-6)


def test_slack_keeps_the_penalty_from_spoiling_the_fit():
    nodes, rows, target, groups = preisach_problem()
    # A load whose lengths do not fit the form of the model: held out it asks for flat weights.
    target = target * (1.0 + 0.2 * groups)
    options = {'groups': groups, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    weakest = fit_weights(rows, target, strength=STRENGTHS[0], **options)
    free = fit_weights(rows, target, **options)
    limited = fit_weights(rows, target, slack=SLACK, **options)
    limit = weakest.rmse * (1.0 + SLACK[1]) + SLACK[0] * weakest.output_range
    assert free.rmse > limit >= limited.rmse
    assert limited.strength < free.strength


def test_only_strengths_within_the_slack_are_tried():
    nodes, rows, target, groups = preisach_problem()
    target = target * (1.0 + 0.2 * groups)
    options = {'groups': groups, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    free = fit_weights(rows, target, **options)
    limited = fit_weights(rows, target, slack=SLACK, **options)
    limit = SLACK[0] * limited.output_range + (1.0 + SLACK[1]) * fit_weights(
        rows, target, strength=STRENGTHS[0], **options).rmse
    within = [fit_weights(rows, target, strength=strength, **options).rmse <= limit
              for strength in STRENGTHS]
    count = len(limited.strengths)
    assert within == [True] * count + [False] * (len(STRENGTHS) - count) and count > 1
    assert limited.validation == pytest.approx(free.validation[:count], rel=1e-6)
    assert limited.held_out_rmse == limited.validation.min()


@pytest.mark.parametrize('noise', [2e-5, 1e-3])
def test_a_step_left_out_says_how_strong_the_penalty_is(noise):
    """By the errors of fits without each of them."""
    nodes, rows, target, groups = preisach_problem(levels=12)
    target = target + noise * np.random.default_rng(5).normal(size=len(target))
    options = {'groups': groups, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    fit = fit_weights(rows, target, press=True, **options)
    assert fit.strengths == pytest.approx(WEAKER_STRENGTHS[-len(fit.strengths):])
    assert fit.held_out_rmse == fit.validation.min()
    assert fit.strength == fit.strengths[np.argmin(fit.validation)]
    chosen = fit_weights(rows, target, strength=fit.strength, **options)
    assert fit.predict(rows) == pytest.approx(chosen.predict(rows), abs=1e-9)

    count, errors = len(target), []
    for row in range(count):
        others = np.arange(count) != row
        # The mean is of one row less, the target's range is the same.
        one = fit_weights(rows[others], target[others], scale=options['scale'],
                          penalty=options['penalty'], strength=fit.strength * count / (count - 1))
        errors.append(one.predict(rows[row]) - target[row])
    assert fit.held_out_rmse == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=0.1)
    trials = fit_weights(rows, target, strengths=[fit.strength], **options)
    assert fit.held_out == pytest.approx(trials.held_out, abs=1e-9)


def test_strengths_too_weak_to_compute_with_are_left_out():
    nodes, rows, target, _ = preisach_problem()
    options = {'press': True, 'scale': cell_areas(nodes), 'penalty': smoothness(nodes)}
    fit = fit_weights(rows, target, strengths=[1e-30, 1e-8], **options)
    assert fit.strengths == pytest.approx([1e-8])
    with pytest.raises(IdentificationError, match='use a(?: larger)? strength'):
        fit_weights(rows, target, strengths=[1e-30], **options)


def test_a_step_that_alone_determines_a_weight_says_nothing_of_the_strength():
    fit = fit_weights(np.eye(6), np.arange(1.0, 7.0), press=True, strengths=[1e-20, 1e-3],
                      anchor=Anchor(np.zeros(6), 0.0))
    assert np.all(np.isfinite(fit.validation))


def test_penalty_picks_one_of_many_solutions():
    nodes, rows, target, groups = preisach_problem()
    fit = fit_weights(rows, target, groups=groups, scale=cell_areas(nodes),
                      penalty=smoothness(nodes), slack=SLACK)
    assert rows.shape == (140, 210)
    assert fit.rank < 141 <= 211
    assert fit.condition > 1.0
    # Rows in another order, and columns in another unit, are the same problem.
    order = np.random.default_rng(0).permutation(len(rows))
    again = fit_weights(rows[order], target[order], groups=groups[order], slack=SLACK,
                        scale=cell_areas(nodes), penalty=smoothness(nodes))
    assert again.predict(rows) == pytest.approx(fit.fitted, abs=1e-9 * fit.output_range)
    assert again.weights * cell_areas(nodes) == pytest.approx(
        fit.weights * cell_areas(nodes), abs=1e-6 * fit.output_range)


def test_errors_are_those_of_eqs_23_and_24():
    design, target, _ = problem(2, noise=0.3)
    fit = fit_weights(design, target, strength=1e-3)
    error = fit.predict(design) - target
    assert fit.mean_percent == pytest.approx(100 * np.mean(np.abs(error)) / np.ptp(target))
    assert fit.std_percent == pytest.approx(
        100 * np.sqrt(np.sum((error - error.mean()) ** 2) / len(error)) / np.ptp(target))
    assert fit.rmse == pytest.approx(np.sqrt(np.mean(error ** 2)))


def test_cells_never_excited_are_named():
    nodes = np.linspace(0.0, 6.0, 7)
    # Without a reversal above 3 only cells that the input has passed both ways say something.
    rows = signed_areas(nodes, np.array([1.0, 2.0, 3.0, 2.0, 1.0, 0.5]))
    fit = fit_weights(rows, np.array([1.0, 2.0, 3.0, 2.5, 1.4, 0.2]), strength=1e-6)
    beta, alpha = np.triu_indices(6)
    assert set(fit.never_excited) == set(np.flatnonzero(alpha >= 3).tolist())


@pytest.mark.parametrize('strength', [None, 1e-6])
def test_interval_holds_new_outputs_as_often_as_it_says(strength):
    inside = []
    for seed in range(30):
        generator = np.random.default_rng(seed)
        design = generator.normal(size=(60, 5))
        weights = np.array([1.0, 2.0, 0.5, 1.0, 3.0])
        target = design @ weights + 0.1 * generator.normal(size=60)
        fit = fit_weights(design, target, groups=np.repeat(np.arange(6), 10), strength=strength,
                          strengths=None if strength else (1e-8, 1e-6, 1e-4))
        new = generator.normal(size=(40, 5))
        measured = new @ weights + 0.1 * generator.normal(size=40)
        low, high = fit.prediction_interval(new, 0.9)
        inside.append(np.mean((low <= measured) & (measured <= high)))
        assert fit.noise_std == pytest.approx(0.1, rel=0.5)
    assert 0.85 < np.mean(inside) < 0.95


def test_interval_grows_away_from_the_data():
    design, target, _ = problem(4, rows=20, columns=3)
    fit = fit_weights(design, target, strength=1e-6)
    low, high = fit.prediction_interval(np.vstack([design.mean(axis=0), 20.0 * design.max(axis=0)]))
    assert (high - low)[1] > 2.0 * (high - low)[0]
    plain = fit_weights(design, target, strength=0.0)
    assert plain.prediction_interval(design)[0] == pytest.approx(
        fit.prediction_interval(design)[0], abs=1e-3)


def test_summary_is_plain_json():
    nodes, rows, target, groups = preisach_problem(levels=6)
    fit = fit_weights(rows, target, groups=groups, scale=cell_areas(nodes))
    summary = json.loads(json.dumps(fit.summary()))
    assert summary['rows'] == len(target) and summary['unknowns'] == 22
    assert len(summary['cross_validation']) == len(STRENGTHS)
    assert summary['rmse'] == pytest.approx(fit.rmse)
    assert summary['strength'] == fit.strength


@pytest.mark.parametrize('change, message', [
    ({'rows': np.ones((3, 2))}, 'do not fit together'),
    ({'rows': np.ones(4)}, 'do not fit together'),
    ({'target': np.array([1.0, np.nan, 0.0, 2.0])}, 'finite'),
    ({'target': np.ones(4)}, 'constant'),
    ({'sign': 0}, 'sign'),
    ({'scale': np.array([1.0, 0.0])}, 'scale'),
    ({'penalty': np.ones((2, 3))}, 'penalty'),
    ({'groups': np.zeros(3)}, 'trial'),
    ({'strengths': ()}, 'strength'),
    ({'strength': -1.0}, 'strength'),
    ({'strength': float('nan')}, 'strength'),
])
def test_bad_input_is_one_line(change, message):
    arguments = {'rows': np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.2]]),
                 'target': np.array([1.0, 2.0, 3.0, 1.0]), **change}
    with pytest.raises(IdentificationError, match=message) as caught:
        fit_weights(arguments.pop('rows'), arguments.pop('target'), **arguments)
    assert '\n' not in str(caught.value)


def test_nnls_that_gives_up_is_one_line(monkeypatch):
    def give_up(*_, **__):
        raise RuntimeError('too many iterations')
    monkeypatch.setattr(optimize, 'nnls', give_up)
    design, target, _ = problem(0)
    with pytest.raises(IdentificationError, match='strength above 0'):
        fit_weights(design, target, strength=0.0)


def test_what_the_fitted_rows_hardly_excite_does_not_predict_the_others():
    """It would take up any misfit of them, and move the rows held out by many times as much."""
    rng = np.random.default_rng(0)
    known = rng.uniform(0.0, 1.0, 60)
    hardly = np.where(np.arange(60) < 40, 0.02 * (np.arange(60) % 5 == 0), 1.0)
    target = known + 0.02 * (hardly > 0.0) * (np.arange(60) < 40) + 0.005 * rng.standard_normal(60)
    trial = np.repeat([0, 1, 2], 20)
    fit = fit_weights(np.column_stack([known, hardly]), target, groups=trial, strength=None,
                      strengths=[1e-6])
    # Taken at its word, the second column would add 1 to the last trial.
    assert np.abs(fit.held_out[trial == 2]).max() < 0.1
    factors = extrapolated(np.column_stack([known, hardly, 0.0 * known]), trial < 2)
    assert factors == pytest.approx([(known.max() / known[:40].max()) ** 2 - 1.0, 2499.0, 0.0])
    assert extrapolated(hardly[:, None], hardly == 0.0) == pytest.approx([1e6 - 1.0])


def test_a_row_of_twice_the_weight_counts_as_two():
    rng = np.random.default_rng(8)
    rows, twice = rng.random((40, 6)), np.arange(40) < 15
    target = rows @ np.array([0.0, 1.0, 0.0, 2.0, 0.5, 0.0]) + 0.4 + 0.1 * rng.standard_normal(40)
    groups = np.arange(40) % 4
    repeated = np.r_[np.arange(40), np.flatnonzero(twice)]
    emphasis = np.sqrt(np.where(twice, 2.0, 1.0) * 40.0 / len(repeated))
    for strength in (None, 1e-4):
        once = fit_weights(rows, target, groups=groups, emphasis=emphasis, strength=strength)
        doubled = fit_weights(rows[repeated], target[repeated], groups=groups[repeated],
                              strength=strength)
        assert once.weights == pytest.approx(doubled.weights, abs=1e-9)
        assert once.bias == pytest.approx(doubled.bias)
        # Folds are weighted by their rows, not by how much these count.
        assert once.validation == pytest.approx(doubled.validation, rel=3e-3)
