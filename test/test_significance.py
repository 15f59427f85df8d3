# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""How likely chance explains as much, against its definition."""

from model_support import autoregressive
import numpy as np
import pytest
from scipy import stats

from hysteresis_ros.diagnosis.significance import (
    block_sums, cosines, gain_interval, independent_rows, paired_p_values, residualise,
    schwarz_log_odds, surely_larger)


def test_paired_p_values_tell_a_steady_gain_from_one_lucky_block():
    """The same sum in every block counts, in a single one it does not."""
    rng = np.random.default_rng(2)
    steady = 1.0 + 0.3 * rng.standard_normal(24)
    lucky = np.r_[24.0, np.zeros(23)]
    values = paired_p_values(np.stack([steady, lucky, -steady]), rng)
    assert values[0] < 0.02 and values[1] > 0.2 and values[2] > 0.9


def test_no_p_value_is_smaller_than_the_draws_can_give():
    """None of 99 draws was as good: one in a hundred, not none."""
    gains = np.ones((1, 200)) + 1e-3 * np.arange(200.0)
    assert paired_p_values(gains, np.random.default_rng(0), 99) == pytest.approx([0.01])


def test_the_interval_of_a_gain_holds_its_value():
    """Half of every residual gone is a gain of exactly one half."""
    rng = np.random.default_rng(3)
    before, block = rng.standard_normal(240), np.arange(240) // 10
    assert gain_interval(before, 0.5 * before, block, rng) == pytest.approx((0.5, 0.5))
    low, high = gain_interval(before, rng.standard_normal(240), block, rng)
    assert low < 0.0 < high
    assert block_sums(np.ones(240), block).tolist() == [10.0] * 24


def test_cosines_and_the_residual_of_columns():
    """Opposite directions are the same signature; projections are orthogonal."""
    vectors = np.array([[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    expected = [[1, 1, 0.5 ** 0.5, 0], [1, 1, 0.5 ** 0.5, 0], [0.5 ** 0.5, 0.5 ** 0.5, 1, 0],
                [0, 0, 0, 0]]
    assert cosines(vectors) == pytest.approx(np.array(expected))
    columns = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, 0.0]])
    residual = residualise(columns, vectors)
    assert np.abs(residual @ columns).max() < 1e-12
    assert residual[2] == pytest.approx([0.0, 0.0, 0.0])
    assert residual[0] == pytest.approx([0.5, -0.5, 0.0])
    assert residualise(np.zeros((3, 0)), vectors) is vectors


def test_schwarz_odds_are_those_of_hand_and_find_the_true_number_of_parameters():
    """A column of noise beside a line pays for itself as often as chi squared exceeds log n."""
    assert schwarz_log_odds(2.0, 1.0, 16, 3) == pytest.approx(
        16.0 * np.log(2.0) - 1.5 * np.log(16.0))
    rng, rows, draws = np.random.default_rng(5), 24, 2000
    preferred = 0
    for _ in range(draws):
        true, noise, measured = rng.standard_normal((3, rows))
        errors = []
        for columns in ([true], [true, noise]):
            design = np.column_stack(columns)
            found = design @ np.linalg.lstsq(design, measured + 3.0 * true, rcond=None)[0]
            errors.append(np.sqrt(np.mean((measured + 3.0 * true - found) ** 2)))
        preferred += schwarz_log_odds(*errors, rows, 1) > 0.0
    assert 0.06 < preferred / draws < 0.11


@pytest.mark.parametrize('ratios, surely', [
    ((1.2, 1.25, 1.3, 1.2), True), ((1.0, 1.0, 1.0, 2.0), False), ((0.9, 1.1, 1.2, 1.0), False),
    ((0.8, 0.75, 0.8, 0.85), False), ((1.5,), False), ((1.001, 1.0011, 1.0009, 1.001), True),
    # Only with too small a spread of four.
    ((1.0, 1.1, 1.2, 1.05), False)])
def test_errors_are_surely_larger_where_chance_over_the_folds_is_not_enough(ratios, surely):
    """As scipy's paired t-test of the logarithms says, one-sided."""
    squares = np.array(ratios) ** 2
    others = 4.0 * np.ones(len(ratios))
    assert surely_larger(4.0 * squares, others, 0.0) == surely
    if len(ratios) > 1:
        test = stats.ttest_1samp(np.log(ratios), 0.0, alternative='greater')
        assert (test.pvalue < 0.05) == surely
    # Errors that are too small to matter are alike.
    assert not surely_larger(4.0 * squares, others, 1e9)


@pytest.mark.parametrize('rho', [0.0, 0.5, 0.9])
def test_rows_that_follow_each_other_tell_less(rho):
    trials, rows = 20, 200
    residual = autoregressive(np.random.default_rng(3), trials, rows, rho)
    trial = np.repeat(np.arange(trials), rows)
    found = independent_rows(residual, trial, 10)
    assert found == pytest.approx(trials * rows * (1.0 - rho) / (1.0 + rho), rel=0.1)
    assert independent_rows(residual, trial, 3900) >= 3900.0


def test_rows_of_different_trials_do_not_follow_each_other():
    jump = np.repeat([1.0, -1.0], 2)
    assert independent_rows(jump, np.arange(4), 1) == 4.0
    assert independent_rows(np.zeros(6), np.zeros(6), 1) == 6.0
    assert independent_rows(np.tile([1.0, -1.0], 9), np.zeros(18), 1) == 18.0
