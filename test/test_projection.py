# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights eliminated from a fit: their derivatives, and the rows that they are fitted to."""

from hysteresis_ros.bicep import BicepGeometry
from hysteresis_ros.diagnosis import bench_weights
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.effects import catalogue
from hysteresis_ros.identification import nonnegative
from hysteresis_ros.identification.bench import identify
from hysteresis_ros.identification.projection import ProjectedWeights
from hysteresis_ros.kernels.shares import shares
from hysteresis_ros.laboratory.experiments import experiment_tables
from hysteresis_ros.laboratory.linkage import GEOMETRY
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.operators import cell_areas, signed_areas
from hysteresis_ros.operators.areas import signed_lengths
import numpy as np
import pytest
from scipy import sparse


def test_derivatives_are_finite_differences_with_the_active_set_fixed():
    rng = np.random.default_rng(1)
    design, slope = rng.normal(size=(2, 20, 30))
    design[:, -1], slope[:, -1] = 1.0, 0.0
    target, drift = rng.normal(size=(2, 20))
    penalty = sparse.diags(np.append(np.full(29, 1e-3), 0.0), format='csr')
    fitted, step = ProjectedWeights(design, target, penalty), 1e-6
    columns = fitted.columns
    assert 1 < len(columns) < 30
    moved = (1.0 + 10.0 * step) * penalty
    other = ProjectedWeights(design + step * slope, target + step * drift, moved, fitted.passive)
    assert np.array_equal(other.passive, fitted.passive)
    found = fitted.moved((design + step * slope)[:, columns], target + step * drift,
                         moved.toarray()[np.ix_(columns, columns)])
    np.testing.assert_allclose(found - fitted.z[columns], (other.z - fitted.z)[columns],
                               atol=1e-4 * np.abs(other.z - fitted.z).max())


def test_shares_times_cells_are_signed_areas_above_the_cold_state():
    rng = np.random.default_rng(0)
    nodes = np.array([-1.0, -0.2, 0.3, 1.7, 3.0])
    parts = [rng.uniform(-1.0, 3.0, 30) for _ in range(3)]
    wanted, scale = rng.random(90) < 0.3, rng.uniform(0.5, 2.0, 90)
    sizes = np.append(cell_areas(nodes), np.diff(nodes))
    expected = sizes + np.concatenate([np.hstack(
        [signed_areas(nodes, part), signed_lengths(nodes, part)]) for part in parts])
    expected = np.column_stack([expected * scale[:, None], np.ones(90)])[wanted]
    for columns in (np.arange(15), np.array([1, 7, 11, 14])):
        found = shares(nodes, np.concatenate(parts), np.array([30, 60, 90]), wanted,
                       scale[wanted], columns)
        np.testing.assert_allclose(
            found * np.append(sizes, 1.0)[columns], expected[:, columns], atol=1e-12)


@pytest.fixture(scope='module')
def problem():
    """Return the judged rows of a bench under four loads."""
    tables = experiment_tables('bench', {}, 3)
    force, length = (Measurement.from_columns(tables[name]) for name in
                     ('force.csv', 'length.csv'))
    model = identify(length, force, geometry=BicepGeometry.from_mapping(GEOMETRY),
                     length_trials=range(4), force_trials=[0]).model
    return problem_for(model, [length.select(range(4))])


def test_weights_are_refitted_to_what_the_models_second_stage_is_given(problem):
    """The load counts as it does in the model, whose own weights say nearly the same."""
    own = problem.pick([m.column('length') - problem.model.predict(m)
                        for m in problem.measurements])
    refitted = problem.measured - problem.simulate([])
    assert np.std(refitted) < 1.2 * np.std(own) < 0.1 * np.std(problem.measured)


def test_a_load_held_out_is_not_predicted_by_what_the_others_hardly_excite(problem, monkeypatch):
    """The heaviest load goes through inputs that the others reach the edge of."""
    held, train = problem.finer().holding_out(), problem.trial != 3
    hardly = nonnegative.extrapolated(held._weights.design([], None).shares, train) > 100.0

    def taken():
        return np.sum(held.solve([], train).weights.z[hardly])

    own = taken()
    monkeypatch.setattr(bench_weights, 'extrapolated', lambda shares, train: np.zeros(
        shares.shape[1]))
    assert 0.0 <= own < 0.01 * taken()


@pytest.mark.parametrize('name, values, parameter', [
    ('stress_dependence', {'C': 0.6}, 'C'),
    ('series_compliance', {'compliance': 0.2}, 'compliance'),
    ('stress_dependent_strain', {'r': 0.5}, 'r'), ('fatigue', {'a': 0.05}, 'a')])
def test_the_response_nearby_is_that_of_a_fit_there(problem, name, values, parameter):
    train = problem.trial != 2
    kind = catalogue()[name]

    def effect(factor):
        return kind(problem.model.surroundings).with_values(
            **{**values, parameter: factor * values[parameter]})

    solution = problem.solve([effect(1.0)], train)
    near = problem.near(solution, [effect(1.0001)], train)
    exact = problem.solve([effect(1.0001)], train)
    assert np.array_equal(exact.weights.passive, solution.weights.passive)
    change = exact.predicted - solution.predicted
    assert np.linalg.norm(change) > 0.0
    assert np.linalg.norm(near - exact.predicted) < 1e-3 * np.linalg.norm(change)
