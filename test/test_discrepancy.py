# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""By how much a model may be wrong beyond what its bench shows, and where."""

import dataclasses

from model_support import arm_run, bicep_model, effect_of, GEOMETRY, runs
import numpy as np
import pytest

from hysteresis_ros.diagnosis import bench_error, discrepancy
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.load_history import load_history
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.model.chain import Chain


@pytest.fixture(scope='module')
def problem():
    """Return rows of a model without any error."""
    model = bicep_model()
    return problem_for(model, [runs(model)])


def test_the_discrepancy_has_the_size_that_the_bench_found(problem):
    """In the angle it is the error of the length times the arm's sensitivity."""
    gain, path = discrepancy.sensitivity(problem, []), load_history(problem, []).path
    predicted = problem.simulate([])
    found = discrepancy.discrepancy_along(problem, [], predicted, Settings()).matrix(courses=False)
    assert np.diag(found) == pytest.approx((0.0004 * gain) ** 2 + path ** 2 / 12.0)
    assert found == pytest.approx(found.T)
    assert np.linalg.eigvalsh(found).min() > -1e-9 * np.max(found)


@pytest.mark.parametrize('name, values', [
    ('stress_dependent_strain', {'r': 0.6, 'F0': 1.2}), ('phase_modulus', {'m': 0.3})])
def test_what_martensite_may_keep_of_its_load_is_an_error_of_all_rows_together(name, values):
    """
    The same share everywhere, from none to all; whatever is said to make the strain grow.

    With `phase_modulus` alone, too, which takes the place of a growth in proportion to the load.
    """
    model = bicep_model()
    growth = effect_of(model, name, **values)
    problem = problem_for(model.with_effects([growth]), [runs(model)])
    found = discrepancy.discrepancy_along(
        problem, [growth], problem.simulate([growth]), Settings())
    half, all_kept, at_rest, anew = (
        problem.simulate([growth, effect_of(model, 'formation_memory', **values)])
        - problem.simulate([growth])
        for values in ({'kept': 0.5}, {'kept': 1.0}, {'kept': 1.0, 'cooled': 0.0},
                       {'kept': 1.0, 'anew': 1.0}))
    assert np.std(all_kept) > 1e-3
    assert found.courses[:, 0] == pytest.approx(all_kept) and found.common.size == 0
    # What each trial begins with lasts until it is heated.
    assert found.courses[:, 2] == pytest.approx(at_rest)
    # What a heavier load orients anew is little on an arm that nothing holds, and what it changes
    # besides.
    assert found.courses[:, 3] == pytest.approx(anew - all_kept)
    assert 0.0 < np.std(anew - all_kept) < 0.2 * np.std(all_kept)
    begun = all_kept - at_rest
    firsts = np.searchsorted(problem.trial, np.unique(problem.trial))
    assert 1.01 * np.abs(begun[firsts]).max() > np.abs(begun).max() > 1e-3
    assert found.matrix() - found.matrix(courses=False) == pytest.approx(
        found.courses @ found.courses.T / 3.0)
    assert half == pytest.approx(0.5 * all_kept, abs=0.1 * np.abs(all_kept).max())
    known = discrepancy.discrepancy_along(
        problem, [growth], problem.simulate([growth]), Settings(), ['formation_memory'])
    assert not np.any(known.courses[:, [0, 2, 3]])
    # Of that a share may differ from place to place.
    by_place = found.parts ** 2 - known.parts ** 2
    assert np.sum(by_place, axis=1) == pytest.approx((anew - all_kept) ** 2 / 12.0)
    assert found.size ** 2 - known.size ** 2 == pytest.approx(np.mean(
        all_kept ** 2 + at_rest ** 2 + (anew - all_kept) ** 2 * (1.0 + 3.0 / 12.0)) / 3.0)


def test_besides_what_has_one_course_the_residual_lacks_a_share_from_none_to_all():
    model = bicep_model()
    growth = effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)
    problem = problem_for(model.with_effects([growth]), [runs(model)])
    found = discrepancy.discrepancy_along(
        problem, [growth], problem.simulate([growth]), Settings())
    assert np.all(np.std(found.courses, axis=0) > 1e-5)
    other = np.cos(np.arange(len(found.courses)))
    other -= found.courses @ np.linalg.lstsq(found.courses, other, rcond=None)[0]
    for shares in ((0.4, 0.7, 0.3, 0.6, 0.2), (0.4, 0.0, 0.5, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0, 0.0)):
        residual = found.courses @ shares + other
        assert found.shares(residual) == pytest.approx(shares, abs=1e-9)
        assert found.besides_courses(residual) == pytest.approx(other)
    kept = found.courses[:, 0]
    alone = dataclasses.replace(found, courses=found.courses * [1.0, 0.0, 0.0, 0.0, 0.0])
    other -= (kept @ other) / (kept @ kept) * kept
    for share, left in ((0.4, 0.0), (1.5, 0.5), (-0.5, -0.5)):
        residual = share * kept + other
        assert alone.besides_courses(residual) == pytest.approx(left * kept + other)
    nothing = dataclasses.replace(alone, courses=0.0 * found.courses)
    assert nothing.besides_courses(other) == pytest.approx(other)
    assert nothing.shares(other).tolist() == [0.0, 0.0, 0.0, 0.0, 0.0]


def test_a_muscle_without_martensite_keeps_nothing(monkeypatch):
    model = bicep_model()
    growth = effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)
    problem = problem_for(model.with_effects([growth]), [runs(model)])
    monkeypatch.setattr(discrepancy.FormationMemory, 'available', lambda surroundings: False)
    found = discrepancy.discrepancy_along(
        problem, [growth], problem.simulate([growth]), Settings())
    assert not np.any(found.courses[:, [0, 2, 3]])


@pytest.mark.parametrize('fitted', [True, False])
def test_what_may_be_kept_is_no_discrepancy_where_it_is_an_effect(fitted):
    """In a set, or tried together with it, its own parameter says how much is kept."""
    model = bicep_model()
    effects = [effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)]
    if fitted:
        effects.append(effect_of(model, 'formation_memory', kept=0.4))
    problem = problem_for(model.with_effects(effects), [runs(model)])
    gain, path = discrepancy.sensitivity(problem, effects), load_history(problem, effects).path
    found = discrepancy.discrepancy_along(
        problem, effects, problem.simulate(effects), Settings(),
        () if fitted else ('slack', 'formation_memory'))
    assert np.diag(found.matrix(courses=False)) == pytest.approx(
        (0.0004 * gain) ** 2 + path ** 2 / 12.0)
    assert not np.any(found.courses[:, [0, 2, 3]])


def test_a_load_that_leaves_no_mark_is_an_error_of_all_rows_together(problem):
    found = discrepancy.discrepancy_along(problem, [], problem.simulate([]), Settings())
    path = load_history(problem, []).path
    assert np.std(path) > 1e-4 and found.courses[:, 4] == pytest.approx(path)
    assert found.besides_courses(0.6 * path) == pytest.approx(0.0 * path, abs=1e-9)


@pytest.mark.parametrize('share', [0.0, 0.2, 0.875, 1.0])
def test_where_part_of_the_wire_follows_its_kinetics_each_place_may_or_may_not(share):
    """With the variance of a draw; none where all of it does, or nothing."""
    model = bicep_model()
    kinetics = [effect_of(model, 'kinetics', share=share)] if share else []
    problem = problem_for(model.with_effects(kinetics), [runs(model)])
    none, whole = problem.simulate_many([[], [effect_of(model, 'kinetics', share=1.0)]])
    assert np.std(whole - none) > 1e-3
    found = discrepancy.discrepancy_along(
        problem, kinetics, problem.simulate(kinetics), Settings())
    assert found.parts[:, -1] ** 2 == pytest.approx(
        share * (1.0 - share) * (whole - none) ** 2, abs=1e-15)


def test_errors_of_rows_that_are_near_on_the_way_and_in_response_are_alike(problem):
    """More so on the same way of the drive than on the way back."""
    predicted, settings = problem.simulate([]), Settings()
    found = discrepancy.discrepancy_along(problem, [], predicted, settings).matrix(courses=False)
    size = np.sqrt(np.diag(found))
    drive, direction = problem.signals['drive'], problem.signals['direction'] > 0.0
    way = discrepancy.way_done(drive, predicted, problem.trial)
    gap = np.hypot(way[:, None] - way,
                   (predicted[:, None] - predicted) / np.ptp(predicted)) / settings.correlation
    # The part that differs between the directions is half of the common one: 1 - 1/4 to 1 + 1/4.
    same = np.where(direction[:, None] == direction[None, :], 1.0, 0.6)
    np.testing.assert_allclose(found / np.outer(size, size), same / np.sqrt(1.0 + gap ** 2),
                               atol=0.03)


def test_the_sensitivity_is_the_slope_of_the_arm(problem):
    """A longer muscle raises the angle by the inverse of dL/dtheta, less what the load gives."""
    gain = discrepancy.sensitivity(problem, [])
    theta = problem.measured
    step = 1e-5
    length = problem.model.geometry.length
    slope = (length(theta + step) - length(theta - step)) / (2.0 * step)
    assert np.all(gain * slope > 0.0)
    assert np.median(gain * slope) == pytest.approx(1.0, abs=0.3)


def test_the_largest_error_that_the_bench_has_shown_counts():
    """Of trials and of loads that were left out; else that of the fitted trials, else none."""
    def error(**length):
        return bench_error.length_error(bicep_model(metrics={
            'length': {part: {'rmse': value} for part, value in length.items()}}))
    assert error(verification=0.0004) == 0.0004
    assert error(verification=0.0004, left_out=0.0015) == 0.0015
    assert error(verification=0.0004, left_out=0.0001) == 0.0004
    assert error(identification=0.001) == 0.001
    assert error(identification=0.001, verification=0.0004) == 0.0004
    assert error(left_out=None, verification=float('nan')) == 0.0
    assert bench_error.length_error(bicep_model(metrics={})) == 0.0


def test_rows_that_were_fitted_are_off_by_less_than_those_that_are_left_out():
    """Where no trial verifies, a row left out says what the model is off by under its load."""
    loads, left_out = (1.0, 3.0, 5.0), [3e-4, 3e-4, 3e-4]
    parts = {'left_out': left_out, 'identification': [1e-5, 2e-5, 1e-5]}

    def error(**further):
        return bench_error.length_errors(
            bicep_model(metrics=by_load(loads, **parts, **further)), np.array(loads))
    fitted, rows = error(), error(rows_left_out=[1e-4, 1e-4, 1e-4])
    assert np.all(fitted < 2.1e-5) and rows == pytest.approx(np.full(3, 1e-4))
    assert error(rows_left_out=[0.0, 0.0, 0.0]) == pytest.approx(fitted)
    assert error(rows_left_out=[1e-4] * 3, verification=[2e-4] * 3) == pytest.approx(
        np.full(3, 2e-4))


def by_load(loads, **parts):
    """Return metrics of a bench with an error [m] under each load [N], of each part."""
    return {'length': {part: {'rmse': max(errors), 'loads': list(loads), 'rmse_by_load': errors}
                       for part, errors in parts.items()}}


def test_the_error_of_the_length_is_that_under_the_load_of_the_arm():
    """As the loads near it say, and the more, the further the next load of the bench is."""
    loads, asked = (1.0, 3.0, 5.0, 9.0), np.array([-1.0, 1.0, 2.5, 5.0, 7.0, 11.0, 13.0])

    def error(**parts):
        return bench_error.length_errors(bicep_model(metrics=by_load(loads, **parts)), asked)
    found = error(left_out=[8e-4, 2e-4, 1e-4, 6e-4], identification=[4e-4, 1e-5, 2e-4, 3e-4])
    at_loads = 1e-8 * np.array([4.0, 0.1, 2.0, 3.0]) ** 2
    further = 1e-8 * np.array([48.0, 3.99, 0.0, 27.0])
    away = np.array([2.0, 0.0, 0.5, 0.0, 2.0, 2.0, 4.0])
    for load, distance, one in zip(np.clip(asked, 1.0, 9.0), away, found):
        near = np.exp(-0.5 * ((load - np.array(loads)) / 2.0) ** 2)
        grown = near @ further / (near @ np.array([4.0, 4.0, 4.0, 16.0])) * distance ** 2
        assert one == pytest.approx(np.sqrt(near @ at_loads / near.sum() + grown))
    same = error(left_out=4 * [1e-4], identification=4 * [1e-5], verification=4 * [3e-4])
    assert same == pytest.approx(len(asked) * [3e-4])


def test_a_load_that_was_left_out_says_twice_what_one_that_lacks_in_between_does():
    """Without it the next one is as far away as they are apart; from their middle it is half."""
    metrics = by_load((1.0, 3.0, 5.0), left_out=3 * [3e-4], identification=3 * [0.0])
    found = bench_error.length_errors(bicep_model(metrics=metrics), np.array([1.0, 2.0, 4.5, 7.0]))
    assert found == pytest.approx([0.0, 1.5e-4, 0.75e-4, 3e-4])


@pytest.mark.parametrize('metrics', [
    by_load((1.0, 7.0), left_out=[8e-4, 2e-4], identification=[1e-5, 1e-5]),
    {'length': {'left_out': {'rmse': 8e-4}}}])
def test_two_loads_have_none_between_them_that_could_tell(metrics):
    found = bench_error.length_errors(bicep_model(metrics=metrics), np.array([1.0, 4.0, 7.0]))
    assert found == pytest.approx(3 * [8e-4])


def test_the_discrepancy_follows_the_load(problem):
    """Where the bench was hardly right under a small load, an arm is less certain there."""
    load = load_history(problem, []).load
    middle = float(np.median(load))
    model = dataclasses.replace(problem.model, metrics=by_load(
        (0.5 * middle, middle, 2.0 * middle), left_out=[9e-4, 1e-4, 1e-4],
        identification=[9e-4, 1e-5, 1e-4]))
    problem = problem_for(model, [runs(model)])
    gain, path = discrepancy.sensitivity(problem, []), load_history(problem, []).path
    found = np.diag(discrepancy.discrepancy_along(
        problem, [], problem.simulate([]), Settings()).matrix(courses=False))
    error = bench_error.length_errors(model, load)
    assert np.ptp(error) > 1e-5
    assert found == pytest.approx((error * gain) ** 2 + path ** 2 / 12.0)


def with_relative(**parts):
    """Return metrics of a bench whose errors differ between ends and halfway."""
    return {'length': {'verification': {'rmse': 4e-4}, **{
        part: {'rmse': 4e-4, 'relative_rmse': dict(zip(('ends', 'halfway'), pair))}
        for part, pair in parts.items()}}}


def test_the_error_halfway_is_as_much_larger_as_the_bench_says():
    share = np.array([-0.1, 0.0, 0.25, 0.5, 1.0, 1.2])

    def found(**parts):
        return bench_error.relative_errors(bicep_model(metrics=with_relative(**parts)), share)
    between = np.sqrt(0.25 * 0.4 ** 2 + 0.75 * 2.0 ** 2)
    assert found(verification=(0.4, 2.0)) == pytest.approx([0.4, 0.4, between, 2.0, 0.4, 0.4])
    # Trials that verify and loads left out count alike.
    both = found(verification=(0.4, 2.0), left_out=(1.0, 1.0))
    assert both ** 2 == pytest.approx(0.5 * (found(verification=(0.4, 2.0)) ** 2 + 1.0))
    assert found() == pytest.approx(np.ones(6))
    assert found(identification=(0.4, 2.0)) == pytest.approx(np.ones(6))


def test_the_discrepancy_is_larger_where_the_muscle_transforms(problem):
    """An arm that is cold or hot is where the bench had most of its rows."""
    model = dataclasses.replace(problem.model, metrics=with_relative(verification=(0.4, 2.0)))
    problem = problem_for(model, [runs(model)])
    gain, history = discrepancy.sensitivity(problem, []), load_history(problem, [])
    found = np.diag(discrepancy.discrepancy_along(
        problem, [], problem.simulate([]), Settings()).matrix(courses=False))
    relative = bench_error.relative_errors(model, history.martensite)
    assert relative.max() - relative.min() > 0.5
    assert found == pytest.approx((4e-4 * gain * relative) ** 2 + history.path ** 2 / 12.0)


def test_an_error_of_the_thresholds_shows_where_the_response_follows_the_drive():
    """Of all at once, so that an arm that stands still since a turn has that of the turn."""
    metrics = with_relative(verification=(0.4, 0.4), left_out=(1.0, 1.0))
    # Of a bench whose response follows by 0.5 mm/V^2, a length that is off by 0.4 mm.
    metrics['length']['verification']['relative_rmse']['drive'] = 0.8
    metrics['length']['verification']['drive_slope'] = 5e-4
    model = bicep_model(metrics=metrics)
    assert bench_error.drive_error(model) == pytest.approx(0.8 / 5e-4)
    metrics['length']['left_out']['relative_rmse']['drive'] = 0.0
    metrics['length']['left_out']['drive_slope'] = 2e-3
    assert bench_error.drive_error(model) == pytest.approx(0.8 / 5e-4 / np.sqrt(2.0))
    assert bench_error.drive_error(bicep_model()) == 0.0
    problem = problem_for(model, [runs(model)])
    along = discrepancy.drive_sensitivity(problem, [])
    squared = problem.signals['drive'] ** 2
    shifted = runs(model)
    voltage = shifted.column('voltage')
    up, down = (model.predict(dataclasses.replace(shifted, columns={
        **shifted.columns, 'voltage': np.sqrt(np.maximum(voltage ** 2 + change, 0.0))}))[
            problem.chosen[0]] for change in (0.1, -0.1))
    rows = squared > 0.2
    assert along[rows] == pytest.approx(((up - down) / 0.2)[rows], rel=0.05, abs=2e-4)
    gain, history = discrepancy.sensitivity(problem, []), load_history(problem, [])
    found = np.diag(discrepancy.discrepancy_along(
        problem, [], problem.simulate([]), Settings()).matrix(courses=False))
    own = gain * bench_error.relative_errors(model, history.martensite)
    thresholds = along * bench_error.drive_error(model)
    assert found == pytest.approx(
        4e-4 ** 2 * (own ** 2 + thresholds ** 2) + history.path ** 2 / 12.0)


def test_martensite_along_the_way_is_that_of_the_second_stage(problem):
    history = load_history(problem, [])
    simulator, = problem.simulators
    outputs = np.concatenate([response.output for response in simulator._responder(
        Chain([], problem.model.surroundings))(simulator.trials)])
    assert history.martensite == pytest.approx(
        problem.model.martensite(outputs)[problem.chosen[0]], abs=5e-3)
    assert history.martensite.max() - history.martensite.min() > 0.5


def path_of(model, measured):
    """Return the difference between a load that moves and one that acted all along."""
    return load_history(problem_for(model, [measured]), []).path


@pytest.mark.parametrize('voltage', [0.0, 2.0, 4.0, 6.0])
def test_a_load_that_holds_still_leaves_nothing_that_the_bench_cannot_tell(voltage):
    """An arm at rest is as on the bench: the load that acts has acted all along."""
    model = bicep_model()
    measured = arm_run(np.full(20, voltage))
    assert np.abs(path_of(model, measured)).max() < 1e-6


def test_a_load_that_moves_with_the_arm_leaves_a_difference():
    """Largest in the middle of the transformation, none at its ends, and less for a light arm."""
    model = bicep_model()
    both_ways = np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)])
    path = np.abs(path_of(model, arm_run(both_ways)))
    assert 1e-3 < path.max() < 0.02
    assert max(path[0], path[-1]) < 0.1 * path.max()
    assert path.max() == max(path[5:35])
    light = bicep_model(geometry=dataclasses.replace(
        GEOMETRY, payload_mass=1e-4, forearm_mass=1e-4))
    assert np.abs(path_of(light, arm_run(both_ways))).max() < 0.02 * path.max()


@pytest.mark.parametrize('name, values', [
    ('transformation_slopes', {'g': 0.4}), ('transformation_slopes', {'g': -0.5}),
    ('cold_clamps', {'share': 0.3})])
def test_loops_that_load_or_cold_ends_change_are_part_of_both_models(name, values):
    """Else the difference would be that of other loops, six or seven times as large."""
    model = bicep_model()
    effect = effect_of(model, name, **values)
    both_ways = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    plain = np.abs(path_of(model, both_ways)).max()
    problem = problem_for(model.with_effects([effect]), [both_ways])
    assert np.abs(load_history(problem, [effect]).path).max() == pytest.approx(plain, rel=0.3)


def test_where_the_strain_does_not_grow_with_the_load_nothing_is_kept():
    """Nor where there is as good as no load."""
    model = bicep_model()
    growth = effect_of(model, 'stress_dependent_strain', r=0.6, F0=1.2)
    moving = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    light = dataclasses.replace(GEOMETRY, payload_mass=1e-4, forearm_mass=1e-4)
    grown = model.with_effects([growth])

    def largest(model):
        problem = problem_for(model, [moving])
        return np.abs(discrepancy.course_of(
            discrepancy.FormationMemory, problem, model.effects)).max()

    assert largest(model) == 0.0
    assert largest(grown) > 1e-3
    assert largest(bicep_model(geometry=light).with_effects([growth])) < 0.02 * largest(grown)


def test_what_the_sensor_adds_is_no_way_of_the_arm():
    """The same arm takes the same way, whatever its encoder says."""
    model = bicep_model()
    problem = problem_for(model, [arm_run(np.linspace(0.0, 6.0, 20))])
    clean = load_history(problem, []).path
    offset = effect_of(model, 'encoder_offset', offset=5.0)
    assert np.abs(clean).max() > 1e-3
    np.testing.assert_array_equal(load_history(problem, [offset]).path, clean)


@pytest.mark.parametrize('name, values', [
    ('overload', {'Fy': 1.0, 'compliance': 5.0}), ('fatigue', {'b': -5.0}),
    # As far as the arm goes.
    ('overload', {'Fy': 0.9, 'compliance': 15.0})])
def test_what_has_lengthened_the_muscle_for_good_does_so_in_both_models(name, values):
    """Else the arm would seem to have been elsewhere if its present load had acted all along."""
    model = bicep_model()
    moving = arm_run(np.concatenate([np.linspace(0.0, 6.0, 20), np.linspace(6.0, 0.0, 20)]))
    effect = effect_of(model, name, **values)
    problem = problem_for(model.with_effects([effect]), [moving])
    longer, = problem.simulate_many([[effect]]) - problem.simulate_many([[]])
    assert np.abs(longer).max() > 0.4
    plain = np.abs(path_of(model, moving))
    found = np.abs(load_history(problem, [effect]).path)
    assert found.max() < 3.0 * plain.max()
    assert max(found[0], found[-1]) < 0.2 * found.max()
