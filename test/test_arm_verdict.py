# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of runs of an arm: which effects could have shown, and what an unknown one is."""

import dataclasses
import math

from model_support import arm_run, bicep_model, effect_of
import numpy as np
import pytest
from selection_support import heavier, recording

from hysteresis_ros.diagnosis.arm_verdict import _Verdict
from hysteresis_ros.diagnosis.diagnose import diagnose
from hysteresis_ros.measurements import Measurement
from hysteresis_ros.model.simulation import Simulator


@pytest.mark.parametrize('name', ['creep', 'overload', 'payload_error'])
def test_what_shows_best_at_small_values_is_not_called_hidden(name):
    """A creep of the largest time begins too late to show, and the largest load never yields."""
    model = bicep_model()
    run = arm_run(np.repeat(np.tile([0.0, 6.0, 1.0, 5.0], 3), 20), 0.2)
    angle = Simulator(model, run).run([])
    noise = 1e-3 * np.random.default_rng(2).standard_normal(len(angle))
    told = diagnose(model, [Measurement.from_columns({**run.columns, 'angle': angle + noise})],
                    [name])
    assert name not in told.not_excited


def test_an_unknown_says_what_would_explain_most_of_it():
    """And that more is left than the model may be off by."""
    model = bicep_model(metrics={'length': {'verification': {'rmse': 1e-4}}})
    measured = recording(model, [effect_of(model, 'payload_error', dm=60.0)])
    wave = 0.05 * np.sin(0.6 * np.arange(measured.rows))
    mixed = Measurement.from_columns(
        {**measured.columns, 'angle': measured.column('angle') + wave})
    told = diagnose(model, [mixed], ['payload_error', 'frame_tilt'])
    assert (told.verdict, told.missing, told.explains_most) == ('unknown', [], ['payload_error'])
    assert 'payload_error shows best' in told.experiment.replace('what is like ', '')
    assert diagnose(model, [measured], ['payload_error', 'frame_tilt']).explains_most == []


def test_a_single_row_that_is_wrong_is_named():
    """A logger that reads the first row before the drive is on."""
    model = bicep_model()
    measured = recording(model)
    angle = measured.column('angle').copy()
    angle[30] += 0.8
    told = diagnose(model, [Measurement.from_columns({**measured.columns, 'angle': angle})],
                    ['payload_error', 'frame_tilt'])
    assert told.verdict == 'unknown'
    assert told.single_row == measured.time[29] + measured.time[30]
    angle[[50, 70]] += 0.8
    told = diagnose(model, [Measurement.from_columns({**measured.columns, 'angle': angle})],
                    ['payload_error', 'frame_tilt'])
    assert (told.verdict, told.single_row) == ('unknown', None)


def test_a_single_row_that_is_wrong_is_named_beside_an_effect():
    """Where the effect changes more than the row, it is the effect's residual that shows it."""
    model = bicep_model()
    measured = recording(model, [effect_of(model, 'payload_error', dm=60.0)])
    angle = measured.column('angle').copy()
    angle[30] += 0.4
    told = diagnose(model, [Measurement.from_columns({**measured.columns, 'angle': angle})],
                    ['payload_error', 'frame_tilt'])
    assert (told.verdict, told.explains_most) == ('unknown', ['payload_error'])
    assert told.single_row == measured.time[29] + measured.time[30]


@pytest.mark.parametrize('row, beyond, verdict', [
    (30, 1.5, 'missing'), (30, 3.0, 'unknown'), (31, 1.5, 'unknown')])
def test_a_play_may_have_been_anywhere_before_a_trial(row, beyond, verdict):
    """And nowhere further than it is wide, nor may what has no memory."""
    model = bicep_model()
    played = effect_of(model, 'backlash', B=8.0)
    measured = recording(model, [played])
    angle = measured.column('angle').copy()
    angle[row] -= beyond * math.radians(8.0)
    told = diagnose(model, [Measurement.from_columns({**measured.columns, 'angle': angle})],
                    ['backlash', 'payload_error'])
    assert told.verdict == verdict


@pytest.fixture(scope='module')
def verdict():
    """Return the verdict on an arm that carries 15 g more."""
    return _Verdict(heavier(bicep_model()))


def test_noise_and_what_the_model_may_be_off_by_are_not_unexplained(verdict, monkeypatch):
    sets, chosen = verdict.sets, frozenset(['payload_error'])
    monkeypatch.setattr(sets, 'own_error', lambda names: 0.3 if names == chosen else 0.5)
    monkeypatch.setattr(sets, 'largest_rmse', 0.1)
    for noise, share in ((0.0, 0.08 / 0.25), (0.2, 0.04 / 0.25), (0.29, 0.0)):
        monkeypatch.setattr(sets, 'white_noise', lambda names, noise=noise: noise)
        assert verdict._unexplained(chosen) == pytest.approx(share)


@pytest.mark.parametrize('other, chosen', [
    # Twins that are together more probable than the set that is more probable than either.
    (0.0, 'encoder_offset'),
    # By 4 and by 6 % of what they explain.
    (0.04, 'encoder_offset'), (0.06, 'frame_tilt')])
def test_sets_that_cannot_be_told_apart_are_one_answer(verdict, monkeypatch, other, chosen):
    sets = verdict.sets
    base = sets.base.predicted
    change = 0.1 * np.sin(np.arange(len(base)))
    names = ('frame_tilt', 'encoder_offset', 'payload_error')
    for name, response in zip(names, (-change, change, (1.0 + other) * change)):
        key = frozenset([name])
        monkeypatch.setitem(sets.fits, key, dataclasses.replace(
            sets.fits[key], predicted=base + response))
    shares = dict(zip(map(frozenset, ([name] for name in names)), (0.4, 0.35, 0.25)))
    assert verdict._most_probable(shares) == frozenset([chosen])
    # What holds more effects is no twin.
    pair = frozenset(['frame_tilt', 'payload_error'])
    monkeypatch.setitem(sets.fits, pair, sets.fits[frozenset(['encoder_offset'])])
    assert not verdict._twins(pair, frozenset(['encoder_offset']))
