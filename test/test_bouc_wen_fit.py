# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The fit of a Bouc-Wen operator: what it recovers, and that it does not hang on its starts."""

import numpy as np
import pytest

from hysteresis_ros.identification.bouc_wen import (
    fit_bouc_wen, HIGHEST, LOWEST, PIECES, starts)
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.operators import BoucWen, Linear

NOISE = 1e-9


@pytest.fixture(scope='module')
def forces():
    """Return drives from the cold one on, and forces, of two trials on the bench."""
    table = Measurement.from_columns(bench_tables({}, 3)['force.csv'])
    return [(np.append(0.0, table.select([trial]).column('voltage')),
             table.select([trial]).column('force')) for trial in (0, 1)]


def simulated(operator, part):
    operator.reset()
    return operator.simulate(part)[1:]


def error(operator, part, target):
    """Return the RMSE as a share of the range."""
    return np.sqrt(np.mean((simulated(operator, part) - target) ** 2)) / np.ptp(target)


def sequence(seed, rows=80):
    return np.append(0.0, np.random.default_rng(seed).uniform(0.0, 6.0, rows))


@pytest.mark.parametrize('stiffness, gain, rate, shape, exponent', [
    (2.0, -0.8, 1.2, 0.7, 1.5),         # lags
    (0.5, 2.0, 0.8, 1.5, 1.4),          # leads
    (0.0, 3.0, 2.0, 0.5, 1.0)])         # a relay that turns slowly
@pytest.mark.parametrize('curve', [(), ([3.0, 5.0], [1.0, -1.5])])
def test_an_operator_of_its_own_kind_is_recovered(
        stiffness, gain, rate, shape, exponent, curve):
    truth = BoucWen(stiffness, gain, rate, shape, exponent, 1.0, 0.0, 6.0, *curve)
    part = sequence(0)
    found = fit_bouc_wen([part], simulated(truth, part), 0.0, 6.0)
    again = sequence(1)
    # The corners of S lie elsewhere than those of the truth.
    assert error(found, again, simulated(truth, again)) < (0.02 if curve else 5e-3)
    if not curve and gain < 0.0:
        assert found.gain * found.stiffness < 0.0


def test_a_line_stays_a_line():
    part = sequence(2)
    truth = Linear(2.0, -1.0, 0.0, 6.0)
    found = fit_bouc_wen([part], simulated(truth, part), 0.0, 6.0)
    assert error(found, sequence(3), simulated(truth, sequence(3))) < 1e-3


def test_data_and_order_of_the_starts_hardly_change_the_result(forces):
    (part, target), (other, verified) = forces
    found = fit_bouc_wen([part], target, 0.0, 6.0)
    errors = np.array([error(found, part, target), error(found, other, verified)])
    # Where the line leaves 10 %.
    assert errors[0] < 0.0033 and errors[1] < 0.0035
    for seed in range(3):
        rng = np.random.default_rng(seed)
        again = fit_bouc_wen(
            [part], target * (1.0 + NOISE * rng.normal(size=len(target))), 0.0, 6.0,
            points=rng.permutation(starts()))
        assert [error(again, part, target), error(again, other, verified)] == pytest.approx(
            errors, rel=0.01)
        assert np.max(np.abs(simulated(again, other) - simulated(found, other))) < 0.01 * np.max(
            np.abs(simulated(found, other) - verified))


def test_a_bad_start_is_not_the_end(forces):
    (part, target), _ = forces
    whole = error(fit_bouc_wen([part], target, 0.0, 6.0), part, target)
    # Any third of the starts finds the same.
    for offset in range(3):
        some = fit_bouc_wen([part], target, 0.0, 6.0, points=starts()[offset::3])
        assert error(some, part, target) == pytest.approx(whole, rel=0.01)


def test_starts_fill_the_bounds():
    points = starts()
    assert np.all(points >= LOWEST) and np.all(points <= HIGHEST)
    spread = (points[-46:] - LOWEST) / (HIGHEST - LOWEST)
    for column in spread.T:
        assert np.all(np.histogram(column, 5, (0.0, 1.0))[0] >= 6)


def test_rows_kept_for_the_search_are_not_all_that_is_fitted(forces):
    (part, target), _ = forces
    rows = [np.arange(0, len(part), 2)]
    found = fit_bouc_wen([part], target, 0.0, 6.0, rows)
    assert len(found.curve.bends) == PIECES - 1
    assert np.mean(simulated(found, part)) == pytest.approx(np.mean(target), abs=1e-9)
