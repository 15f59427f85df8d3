# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""The models that the paper compares with."""

import numpy as np
import pytest

from hysteresis_ros.errors import IdentificationError
from hysteresis_ros.identification.baselines import (
    fit_additive, fit_embedded_line, fit_linear, fit_one_load, simulate)
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.laboratory.experiments import bench_tables
from hysteresis_ros.laboratory.plant import Plant
from hysteresis_ros.laboratory.sequences import damped_oscillation
from hysteresis_ros.measurements import Measurement

VOLTS = damped_oscillation()


def table(loads, length):
    """Return a length table with the oscillation under each load."""
    rows = [(trial, step, volt, load) for trial, load in enumerate(loads)
            for step, volt in enumerate(VOLTS)]
    trial, step, volt, load = np.array(rows).T
    return Measurement.from_columns({'trial': trial, 'step': step, 'voltage': volt, 'force': load,
                                     'length': length(volt, load)})


def forces(force):
    return Measurement.from_columns({'trial': np.zeros(len(VOLTS)), 'step': np.arange(len(VOLTS)),
                                     'voltage': VOLTS, 'force': force(VOLTS)})


@pytest.fixture(scope='module')
def bench():
    """Return force table, length table fitted and length table that verifies."""
    tables = bench_tables({}, 1)
    force = Measurement.from_columns(tables['force.csv']).select([0])
    length = Measurement.from_columns(tables['length.csv'])
    return force, length.select([0, 1, 2, 3]), length.select([4, 5, 6, 7])


def percent(predicted, measurement):
    measured = measurement.column(measurement.response)
    return 100.0 * np.mean(np.abs(predicted - measured)) / np.ptp(measured)


def test_line_recovers_the_constants_of_eq_11():
    length = table((1.0, 3.0), lambda volt, load: 0.88e-3 * (load - 2.69 * volt + 0.15))
    for linear in (fit_linear(length, forces(lambda volt: 2.69 * volt - 0.15)),
                   fit_linear(length)):
        assert (linear.k1, linear.k2, linear.F0) == pytest.approx((2.69, 0.88e-3, -0.15))


def test_line_of_one_load_predicts_it():
    length = table((3.0,), lambda volt, load: 0.01 - 0.002 * volt)
    linear = fit_linear(length)
    assert linear.k2 == 1.0
    assert linear.length(VOLTS, 3.0) == pytest.approx(length.column('length'))


def test_line_of_forces_alone():
    linear = fit_linear(force=forces(lambda volt: 2.0 * volt + 1.0))
    assert (linear.k1, linear.k2, linear.F0) == pytest.approx((2.0, 1.0, 1.0))


def test_line_needs_a_drive_that_varies():
    still = Measurement.from_columns({'voltage': np.ones(3), 'length': 0.1 * np.arange(3.0)})
    with pytest.raises(IdentificationError, match='does not vary'):
        fit_linear(still)
    with pytest.raises(IdentificationError, match='no table'):
        fit_linear()


def test_additive_model_recovers_one_of_its_own_kind():
    def length(volt, load):
        return 1e-3 * (0.5 * load ** 2 - 2.0 * volt)
    model, fit = fit_additive(table((1.0, 2.0, 3.0, 4.0), length), levels=8)
    again = table((4.0, 1.0, 3.0, 2.0), length)
    # Cells of finite size loop where the truth does not.
    assert percent(simulate(model, again), again) < 1.5
    assert fit.rank < len(fit.weights)


def test_embedded_line_is_the_cascade_with_a_line(bench):
    force, fitted, _ = bench
    model, fit = fit_embedded_line(fitted, force)
    first, _ = model.stages
    assert np.polyfit(force.column('voltage'), force.column('force'), 1) == pytest.approx(
        [first.slope, first.intercept])
    assert simulate(model, fitted) == pytest.approx(fit.fitted, abs=1e-9)


def test_rejected_models_are_worse_than_two_stages(bench):
    force, fitted, verified = bench
    two = identify(fitted, force).model
    errors = {'two-stage': percent(two.predict(verified), verified),
              'linear': percent(two.predict(verified, 'linear'), verified),
              'additive': percent(simulate(fit_additive(fitted)[0], verified), verified),
              'line': percent(simulate(fit_embedded_line(fitted, force)[0], verified), verified)}
    assert errors['two-stage'] == min(errors.values())
    assert errors['two-stage'] < 0.5 * min(errors['additive'], errors['line'])
    assert errors['linear'] == max(errors.values())


def test_one_operator_is_better_at_its_own_load_and_for_no_other(bench):
    force, fitted, verified = bench
    two = identify(fitted, force).model
    own, other = verified.select([5]), verified.select([7])
    model, _ = fit_one_load(fitted.select([1]))
    assert percent(simulate(model, own), own) < percent(two.predict(own), own)
    assert percent(simulate(model, other), other) > percent(two.predict(other), other)


def test_baselines_say_what_is_missing(bench):
    _, fitted, _ = bench
    with pytest.raises(IdentificationError, match='select the trials under one load'):
        fit_one_load(fitted)
    with pytest.raises(IdentificationError, match='two loads'):
        fit_additive(fitted.select([2]))


def test_cold_state_is_before_the_first_row():
    # A first row that is hot: the model must have come from the cold state.
    plant = Plant(0)
    volts = np.append(4.5, VOLTS[1:])
    length = Measurement.from_columns({
        'voltage': volts, 'force': np.full(len(volts), 3.136),
        'length': plant.length_trial(volts, 3.136)})
    model, fit = fit_one_load(length)
    model.reset()
    model.step(0.0)
    assert model.step(-4.5) == pytest.approx(fit.fitted[0], abs=1e-12)
