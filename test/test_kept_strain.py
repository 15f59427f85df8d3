# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says of martensite that keeps strain, which no constant load shows."""

import dataclasses

from model_support import bicep_model, effect_of, runs, with_noise
import numpy as np
import pytest

from hysteresis_ros.diagnosis import discrepancy
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.diagnosis.kind import problem_for
from hysteresis_ros.diagnosis.settings import Settings
from hysteresis_ros.report.words import verdict_in_words

TRIED = ['payload_error', 'encoder_offset', 'end_stop']
NOISE = 3e-4


@pytest.fixture(scope='module')
def model():
    """Return a model whose strain grows with the load, and which is right on its bench."""
    made = bicep_model()
    return made.with_effects([effect_of(made, 'stress_dependent_strain', r=0.6, F0=1.2)])


def diagnosis_of(model, *effects, tried=TRIED, rows=30):
    """Return the diagnosis of a recording in which more effects act than the model has."""
    truth = model.with_effects([*model.effects, *effects])
    recording = runs(truth, rows=rows)
    noise = NOISE * np.random.default_rng(4).standard_normal(recording.rows)
    return diagnose(model, [with_noise(recording, noise)], tried)


@pytest.mark.parametrize('cooled', [1.0, 0.0])
def test_a_wire_that_keeps_strain_is_no_fault_of_the_arm_but_said(model, cooled):
    """Whether each trial begins with a wire that has cooled down on the arm, or was hung cold."""
    found = diagnosis_of(model, effect_of(model, 'formation_memory', kept=0.8, cooled=cooled))
    assert (found.verdict, found.missing) == ('adequate', [])
    kept = found.to_dict()['kept_strain']
    assert kept['effect'] == 'formation_memory'
    assert kept['kept'] == pytest.approx(0.8, abs=0.05)
    assert kept['rmse_before'] > 5e-3 > 5.0 * NOISE > kept['rmse_after']
    assert 'extend --add formation_memory' in found.experiment
    assert f'keeps {100.0 * kept["kept"]:.0f} % of its strain' in verdict_in_words(found)


def test_it_is_said_besides_what_is_missing(model):
    found = diagnosis_of(model, effect_of(model, 'formation_memory', kept=0.8),
                         effect_of(model, 'payload_error', dm=40.0))
    assert found.missing == ['payload_error']
    assert found.kept_strain['kept'] == pytest.approx(0.8, abs=0.1)
    assert found.effects[0].values['dm'] == pytest.approx(40.0, abs=4.0)


@pytest.mark.slow
@pytest.mark.parametrize('name, values', [
    ('payload_error', {'dm': 40.0}), ('encoder_offset', {'offset': 3.0})])
def test_nothing_is_said_of_a_wire_that_keeps_nothing(model, name, values):
    found = diagnosis_of(model, effect_of(model, name, **values))
    assert found.missing == [name] and found.kept_strain is None
    assert diagnosis_of(model).kept_strain is None


@pytest.mark.parametrize('kept', [0.0, 0.8])
def test_what_a_wire_may_keep_hides_nothing_of_another_course(model, kept):
    """A play leaves less than what the wire may keep, of which only the share is not known."""
    exact = dataclasses.replace(model, metrics={'length': {'verification': {'rmse': 1e-4}}})
    found = diagnosis_of(exact, effect_of(model, 'formation_memory', kept=kept),
                         effect_of(model, 'backlash', B=1.5), tried=[*TRIED, 'backlash'])
    assert found.missing == ['backlash']
    assert found.effects[0].values['B'] == pytest.approx(1.5, abs=0.4)
    assert kept or found.bench_error < found.rmse_before < found.structural_error


def test_nothing_is_said_where_the_strain_does_not_grow_with_the_load():
    found = diagnosis_of(bicep_model())
    assert found.verdict == 'adequate' and found.kept_strain is None


def test_where_it_is_tried_by_name_the_sets_say_it(model):
    found = diagnosis_of(model, effect_of(model, 'formation_memory', kept=0.8),
                         tried=[*TRIED, 'formation_memory'])
    assert found.kept_strain is None
    assert found.ranking[0]['effect'] == 'formation_memory'


def test_what_a_play_makes_of_a_share_is_not_that_share_of_what_it_makes_of_all(model):
    """So that each course is that of the share which explains most of the residual."""
    play = effect_of(model, 'backlash', B=6.0)
    whole = [*model.effects, play]
    problem = problem_for(model, [runs(model, rows=30)])
    own, kept_strain = problem.simulate_many(
        [whole, [*whole, effect_of(model, 'formation_memory', kept=0.35)]])
    residual = kept_strain - own
    left = [np.std(discrepancy.discrepancy_along(
        problem, whole, own, Settings(), residual=known).besides_courses(residual))
        for known in (None, residual)]
    assert left[0] > 0.05 * np.std(residual) and left[1] < 0.4 * left[0]


def test_what_a_heavier_load_orients_is_that_of_what_is_kept(model):
    """By what forms on the way down to rest, and what was hung cold."""
    problem = problem_for(model, [runs(model, rows=30)])
    shares = 0.3, 0.0, 0.4, 0.0, 0.0
    *_, anew = discrepancy._courses_along(problem, model.effects, (), shares).T
    kept, oriented = problem.simulate_many([[*model.effects, effect_of(
        model, 'formation_memory', kept=0.7, anew=form)] for form in (0.0, 1.0)])
    assert anew == pytest.approx((oriented - kept) / 0.7)
    *_, of_all = discrepancy._courses_along(problem, model.effects, ()).T
    assert np.abs(anew - of_all).max() > 1e-4
